#include "doppel/control/controllers/detail/controller_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

const ParameterOverride* written_value(const ControllerContext& context, const std::string& name) {
  return context.overrides == nullptr ? nullptr : context.overrides->find(name);
}

// A text or a list is missing while it is empty, a number if it is not written.
bool is_missing(const ControllerContext& context, const ParameterField& field) {
  return std::visit(
      [&](const auto* member) {
        if constexpr (requires { member->empty(); }) return member->empty();
        return written_value(context, field.name) == nullptr;
      },
      field.member);
}

ParameterOptions finite_number(double least, bool least_included, const char* problem) {
  return {.check = [=](const ParameterValue& value) {
    const double number = std::get<double>(value);
    const bool fine = std::isfinite(number) && (number > least || (least_included && number == least));
    return fine ? Status{} : Status::refused(problem);
  }};
}

}  // namespace

Requirement required_for_base(const char* fix, const char* problem) {
  return {"control.base_parameter", fmt::format(": '{{}}' {}", problem), fix};
}

Requirement required_value(const std::string& example, const std::string& consequence) {
  return {"control.empty_parameter", " has no '{}'" + consequence,
          "write {}: " + example + " below its ros__parameters"};
}

ParameterOptions positive() {
  return finite_number(0, false, "it must be above 0");
}

ParameterOptions not_negative() {
  return finite_number(0, true, "it must be at least 0");
}

ParameterOptions one_of(std::vector<std::string> choices) {
  return {.check = [choices = std::move(choices)](const ParameterValue& value) {
    const auto& text = std::get<std::string>(value);
    if (std::ranges::find(choices, text) != choices.end()) return Status{};
    return Status::refused(fmt::format("unknown '{}'{}", text, did_you_mean(text, choices)));
  }};
}

void declare_parameters(ControllerContext& context, const ControllerParameters& list) {
  for (const ControllerParameter& one : list) {
    declare_field(context.node->parameters(), context.overrides, one);
    if (one.requirement.rule == nullptr || !is_missing(context, one)) continue;
    throw InputError(one.requirement.rule, place_of(context, one.name),
                     fmt::format("controller '{}'{}", context.name,
                                 fmt::format(fmt::runtime(one.requirement.problem), one.name)),
                     fmt::format(fmt::runtime(one.requirement.fix), one.name));
  }
}

bool declare_old_name(ControllerContext& context, const char* rule, const ControllerParameter& old,
                      const std::string& present) {
  return std::visit(
      [&]<class T>(T* member) {
        T value{};
        ControllerParameter declared = old;
        declared.member = &value;
        declare_parameters(context, {declared});
        if (value == T{}) return false;
        report_parameter(context, rule, old.name, "is deprecated", "write " + present);
        *member = std::move(value);
        return true;
      },
      old.member);
}

void read_parameters(const Parameters& parameters, const ControllerParameters& list) {
  for (const ControllerParameter& one : list) {
    if (!one.rules.read_only) read_field(parameters, one);
  }
}

void refuse_parameter(const ControllerContext& context, const char* rule, const std::string& parameter,
                      const std::string& why, const std::string& fix) {
  throw InputError(rule, place_of(context, parameter),
                   fmt::format("controller '{}': '{}' {}", context.name, parameter, why), fix);
}

void report_parameter(const ControllerContext& context, const char* rule, const std::string& parameter,
                      const std::string& why, const std::string& fix) {
  const ParameterOverride* written = written_value(context, parameter);
  // "<generated controllers>" is not a file of the user.
  if (written == nullptr || (written->source.known() && written->source.file->starts_with('<'))) return;
  log_diagnostic(
      *context.log, context.name,
      {Severity::warning, rule, fmt::format("'{}' {}", parameter, why), place_of(context, parameter), fix});
}

}  // namespace doppel
