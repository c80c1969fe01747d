#include "doppel/control/controllers/detail/speed_limit_parameters.h"

#include <cmath>

namespace doppel {
namespace {

ParameterOptions limit_with_sign(bool upper) {
  return {.check = [upper](const ParameterValue& value) {
    const double number = std::get<double>(value);
    if (std::isnan(number) || (upper ? number >= 0 : number <= 0)) return Status{};
    return Status::refused(upper ? "it must be at least 0, or NaN" : "it must be at most 0, or NaN");
  }};
}

}  // namespace

ControllerParameters SpeedLimitParameters::list(const std::string& component, bool with_deprecated) {
  const ParameterOptions upper = limit_with_sign(true), lower = limit_with_sign(false);
  const std::string c = component + ".";
  SpeedLimits& l = limits;
  ControllerParameters list{
      {c + "max_velocity", &l.max_velocity, "upper limit of the velocity; NaN: none", upper},
      {c + "min_velocity", &l.min_velocity, "lower limit of the velocity; NaN: -max_velocity", lower},
      {c + "max_acceleration", &l.max_acceleration, "of a positive velocity; NaN: none", upper},
      {c + "max_deceleration", &l.max_deceleration, "of a positive velocity; NaN: max_acceleration_reverse",
       lower},
      {c + "max_acceleration_reverse", &l.max_acceleration_reverse,
       "of a negative velocity; NaN: -max_acceleration", lower},
      {c + "max_deceleration_reverse", &l.max_deceleration_reverse,
       "of a negative velocity; NaN: max_acceleration", upper},
      {c + "max_jerk", &l.max_jerk, "while the acceleration grows; NaN: none", upper},
      {c + "min_jerk", &l.min_jerk, "while the acceleration grows; NaN: -max_jerk", lower}};
  if (!with_deprecated) return list;
  constexpr const char* kOff = "deprecated: false turns the limits off";
  list.emplace_back(c + "has_velocity_limits", &has_velocity, kOff);
  list.emplace_back(c + "has_acceleration_limits", &has_acceleration, kOff);
  list.emplace_back(c + "has_jerk_limits", &has_jerk, kOff);
  list.emplace_back(c + "min_acceleration", &min_acceleration, "deprecated, without effect");
  return list;
}

void report_deprecated_limits(const ControllerContext& context, const SpeedLimitParameters& parameters,
                              const std::string& component) {
  const auto report = [&](const char* kind, bool on) {
    report_parameter(context, kDeprecated, component + ".has_" + kind + "_limits",
                     on ? "is deprecated and has no effect" : "is deprecated: its limits are off",
                     on ? "remove it" : "remove it, and set the limits to .nan");
  };
  report("velocity", parameters.has_velocity);
  report("acceleration", parameters.has_acceleration);
  report("jerk", parameters.has_jerk);
  report_parameter(context, kDeprecated, component + ".min_acceleration",
                   "is deprecated: the controller does not read it",
                   "write " + component + ".max_deceleration");
}

SpeedLimits SpeedLimitParameters::present() const {
  SpeedLimits out = limits;
  if (!has_velocity) out.min_velocity = out.max_velocity = kNaN;
  if (!has_acceleration) {
    out.max_acceleration = out.max_deceleration = kNaN;
    out.max_acceleration_reverse = out.max_deceleration_reverse = kNaN;
  }
  if (!has_jerk) out.min_jerk = out.max_jerk = kNaN;
  return out;
}

}  // namespace doppel
