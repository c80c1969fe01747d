#include "doppel/control/controllers/detail/speed_limit_parameters.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "doppel/control/controllers/detail/parameter_value.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

struct LimitParameter {
  const char* name;
  double SpeedLimits::*value;
  bool upper;  // else it is at most 0
  const char* description;
};

constexpr std::array<LimitParameter, 8> kLimitParameters{{
    {"max_velocity", &SpeedLimits::max_velocity, true, "upper limit of the velocity; NaN: none"},
    {"min_velocity", &SpeedLimits::min_velocity, false, "lower limit of the velocity; NaN: -max_velocity"},
    {"max_acceleration", &SpeedLimits::max_acceleration, true, "of a positive velocity; NaN: none"},
    {"max_deceleration", &SpeedLimits::max_deceleration, false,
     "of a positive velocity; NaN: max_acceleration_reverse"},
    {"max_acceleration_reverse", &SpeedLimits::max_acceleration_reverse, false,
     "of a negative velocity; NaN: -max_acceleration"},
    {"max_deceleration_reverse", &SpeedLimits::max_deceleration_reverse, true,
     "of a negative velocity; NaN: max_acceleration"},
    {"max_jerk", &SpeedLimits::max_jerk, true, "while the acceleration grows; NaN: none"},
    {"min_jerk", &SpeedLimits::min_jerk, false, "while the acceleration grows; NaN: -max_jerk"},
}};

Status check_sign(const ParameterValue& value, bool upper) {
  const double number = std::get<double>(value);
  if (std::isnan(number) || (upper ? number >= 0 : number <= 0)) return {};
  return Status::refused(fmt::format("it must be at {} 0, or NaN", upper ? "least" : "most"));
}

void report_deprecated(const ControllerContext& context, const std::string& parameter, const std::string& why,
                       const std::string& fix) {
  const SourceLocation where = place_of(context, parameter);
  if (!where.known()) return;
  log_diagnostic(*context.log, context.name,
                 {Severity::warning, "control.deprecated_parameter", fmt::format("'{}' {}", parameter, why),
                  where, fix});
}

}  // namespace

void declare_speed_limits(ControllerContext& context, const std::string& component,
                          DeprecatedLimits deprecated) {
  Parameters& parameters = context.node->parameters();
  for (const LimitParameter& limit : kLimitParameters) {
    declare<double>(parameters, context.overrides, component + "." + limit.name, kNaN,
                    {limit.description, false, [upper = limit.upper](const ParameterValue& value) {
                       return check_sign(value, upper);
                     }});
  }
  if (deprecated == DeprecatedLimits::absent) return;
  for (const char* kind : {"velocity", "acceleration", "jerk"}) {
    const std::string name = fmt::format("{}.has_{}_limits", component, kind);
    const bool on = declare<bool>(parameters, context.overrides, name, true,
                                  {"deprecated: false turns the limits off", false, {}});
    report_deprecated(context, name,
                      on ? "is deprecated and has no effect" : "is deprecated: its limits are off",
                      on ? "remove it" : "remove it, and set the limits to .nan");
  }
  const std::string unread = component + ".min_acceleration";
  declare<double>(parameters, context.overrides, unread, kNaN, {"deprecated, without effect", false, {}});
  report_deprecated(context, unread, "is deprecated: the controller does not read it",
                    fmt::format("write {}.max_deceleration", component));
}

SpeedLimits speed_limits(const Parameters& parameters, const std::string& component) {
  SpeedLimits limits;
  for (const LimitParameter& limit : kLimitParameters)
    limits.*(limit.value) = parameter_value<double>(parameters, component + "." + limit.name);
  const auto is_off = [&](const char* kind) {
    const std::string name = fmt::format("{}.has_{}_limits", component, kind);
    return parameters.find(name) != nullptr && !parameter_value<bool>(parameters, name);
  };
  if (is_off("velocity")) limits.min_velocity = limits.max_velocity = kNaN;
  if (is_off("acceleration")) {
    limits.max_acceleration = limits.max_deceleration = kNaN;
    limits.max_acceleration_reverse = limits.max_deceleration_reverse = kNaN;
  }
  if (is_off("jerk")) limits.min_jerk = limits.max_jerk = kNaN;
  return limits;
}

}  // namespace doppel
