#include "doppel/ros/bus/parameter_fields.h"

#include <limits>
#include <utility>

namespace doppel {
namespace {

void store_member(const ParameterMember& member, const ParameterValue& value) {
  std::visit([&value]<class T>(T* target) { *target = std::get<T>(value); }, member);
}

}  // namespace

ParameterOptions read_only(ParameterOptions rules) {
  rules.read_only = true;
  return rules;
}

ParameterOptions value_range(double lower, double upper) {
  return {.range = ParameterRange{lower, upper}};
}

ParameterOptions minimum(double least) {
  return value_range(least, std::numeric_limits<double>::infinity());
}

void declare_field(Parameters& parameters, ParameterOverrides* overrides, const ParameterField& field) {
  ParameterOptions options = field.rules;
  options.description = field.description;
  ParameterValue initial =
      std::visit([](const auto* member) { return ParameterValue(*member); }, field.member);
  store_member(field.member,
               declare_parameter(parameters, overrides, field.name, std::move(initial), std::move(options)));
}

void read_field(const Parameters& parameters, const ParameterField& field) {
  store_member(field.member, parameters.find(field.name)->value);
}

void follow_field(Parameters& parameters, const ParameterField& field) {
  parameters.on_change(
      [name = field.name, member = field.member](const std::string& changed, const ParameterValue& value) {
        if (changed == name) store_member(member, value);
      });
}

}  // namespace doppel
