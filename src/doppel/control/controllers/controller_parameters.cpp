#include "doppel/control/controllers/detail/controller_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/control/manager/distro_differences.h"
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

constexpr const char* kNotInDistro = "control.not_in_distro";

// The member takes the default of the process's distribution. Returns whether that has the parameter; one
// that is written although it has not is reported, and ignored as ROS 2 ignores it.
bool adapt_to_distro(const ControllerContext& context, const ParameterField& field) {
  if (const DistroDefault* const changed = changed_default(context.type, field.name)) {
    std::visit(
        []<class T, class V>(T* member, const V& value) {
          if constexpr (std::is_assignable_v<T&, V> && std::is_same_v<V, bool> == std::is_same_v<T, bool>)
            *member = value;
        },
        field.member, *changed);
  }
  const ParameterRow* const missing = missing_parameter(context.type, field.name);
  if (missing == nullptr) return true;
  report_parameter(context, kNotInDistro, field.name,
                   fmt::format("is not a parameter of {}, which ignores it", title(ros_distro())),
                   fmt::format("write {}", missing->instead));
  ParameterOverride* const written =
      context.overrides == nullptr ? nullptr : context.overrides->find(field.name);
  if (written != nullptr) written->used = true;  // it is not a typo
  return false;
}

// Such a value is refused, as its controller does in ROS 2.
void refuse_missing_value(const ControllerContext& context, const ParameterField& field) {
  const auto* const text = std::get_if<std::string*>(&field.member);
  const ParameterRow* const missing =
      text == nullptr ? nullptr : missing_value(context.type, field.name, **text);
  if (missing == nullptr) return;
  refuse_parameter(context, kNotInDistro, field.name,
                   fmt::format("is '{}', which {} does not have", **text, title(ros_distro())),
                   fmt::format("write {}", missing->instead));
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
    if (!adapt_to_distro(context, one)) continue;
    declare_field(context.node->parameters(), context.overrides, one);
    refuse_missing_value(context, one);
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
    const bool is_declared = parameters.find(one.name) != nullptr;  // a distribution may not have it
    if (!one.rules.read_only && is_declared) read_field(parameters, one);
  }
}

void refuse_parameter(const ControllerContext& context, const char* rule, const std::string& parameter,
                      const std::string& why, const std::string& fix) {
  throw InputError(rule, place_of(context, parameter),
                   fmt::format("controller '{}': '{}' {}", context.name, parameter, why), fix);
}

void report_parameter(const ControllerContext& context, const char* rule, const std::string& parameter,
                      const std::string& why, const std::string& fix) {
  if (rule != kNotInDistro && missing_parameter(context.type, parameter) != nullptr)
    return;  // reported already
  const ParameterOverride* written = written_value(context, parameter);
  // "<generated controllers>" is not a file of the user.
  if (written == nullptr || (written->source.known() && written->source.file->starts_with('<'))) return;
  log_diagnostic(
      *context.log, context.name,
      {Severity::warning, rule, fmt::format("'{}' {}", parameter, why), place_of(context, parameter), fix});
}

}  // namespace doppel
