#include "doppel/control/controllers/detail/pid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "doppel/base/core/names.h"
#include "doppel/control/hardware/nan.h"

namespace doppel {
namespace {

// In the order of Pid::AntiWindup.
const std::vector<std::string>& strategies() {
  static const std::vector<std::string> names = {"legacy", "back_calculation", "conditional_integration",
                                                 "none"};
  return names;
}

}  // namespace

ControllerParameters gain_parameters(PidGains& gains, const std::string& prefix,
                                     const ParameterOptions& times) {
  return {{prefix + "p", &gains.p, "proportional"},
          {prefix + "i", &gains.i, "integral, 1/s"},
          {prefix + "d", &gains.d, "derivative, s"},
          {prefix + "i_clamp_max", &gains.i_clamp_max, "of the integral term"},
          {prefix + "i_clamp_min", &gains.i_clamp_min, "of the integral term"},
          {prefix + "u_clamp_max", &gains.u_clamp_max, "of the command"},
          {prefix + "u_clamp_min", &gains.u_clamp_min, "of the command"},
          {prefix + "tracking_time_constant", &gains.tracking_time_constant,
           "s, of back_calculation; 0: from the gains", times},
          {prefix + "error_deadband", &gains.error_deadband, "error below which the integral is not updated",
           times}};
}

Status check_gains(const PidGains& gains) {
  const std::pair<const char*, double> finite[] = {{"p", gains.p},
                                                   {"i", gains.i},
                                                   {"d", gains.d},
                                                   {"tracking_time_constant", gains.tracking_time_constant},
                                                   {"error_deadband", gains.error_deadband}};
  for (const auto& [name, value] : finite) {
    if (!std::isfinite(value))
      return Status::refused(fmt::format("{} is {}; give a finite number", name, value));
  }
  if (gains.tracking_time_constant < 0 || gains.error_deadband < 0) {
    return Status::refused("tracking_time_constant and error_deadband must not be negative");
  }
  // Negated comparisons also reject NaN.
  if (!(gains.i_clamp_min <= gains.i_clamp_max)) {
    return Status::refused(fmt::format("i_clamp_min {} is above i_clamp_max {}; exchange them",
                                       gains.i_clamp_min, gains.i_clamp_max));
  }
  if (!(gains.u_clamp_min <= gains.u_clamp_max)) {
    return Status::refused(fmt::format("u_clamp_min {} is above u_clamp_max {}; exchange them",
                                       gains.u_clamp_min, gains.u_clamp_max));
  }
  if (std::find(strategies().begin(), strategies().end(), gains.antiwindup_strategy) == strategies().end()) {
    return Status::refused(fmt::format("there is no antiwindup_strategy '{}'{}", gains.antiwindup_strategy,
                                       did_you_mean(gains.antiwindup_strategy, strategies())));
  }
  return {};
}

void Pid::set_gains(const PidGains& gains) {
  gains_ = gains;
  const auto found = std::find(strategies().begin(), strategies().end(), gains.antiwindup_strategy);
  antiwindup_ = static_cast<AntiWindup>(found - strategies().begin());
  tracking_time_ = gains.tracking_time_constant;
  if (tracking_time_ == 0 && gains.i != 0) {
    tracking_time_ = gains.d != 0 ? std::sqrt(std::abs(gains.d / gains.i)) : std::abs(gains.p / gains.i);
  }
}

void Pid::reset() {
  memory_ = {};
}

double Pid::integral_rate(double error, double free, double put_out) const {
  const double plain = gains_.i * error;
  switch (antiwindup_) {
    case AntiWindup::back_calculation:
      if (gains_.i == 0 || tracking_time_ == 0) return plain;
      return plain + (put_out - free) / tracking_time_;
    case AntiWindup::conditional_integration:
      return free != put_out && error * free > 0 ? 0.0 : plain;
    default:
      return plain;
  }
}

double Pid::compute(double error, double error_dot, double dt_s) {
  if (!(dt_s > 0)) return memory_.output;
  if (!std::isfinite(error) || !std::isfinite(error_dot)) return kNaN;
  const bool integrates = std::abs(error) > gains_.error_deadband;
  const auto integrate = [this, dt_s](double rate) {
    memory_.integral = std::clamp(memory_.integral + rate * dt_s, gains_.i_clamp_min, gains_.i_clamp_max);
  };
  if (integrates && antiwindup_ == AntiWindup::legacy) integrate(gains_.i * error);
  const double free = gains_.p * error + memory_.integral + gains_.d * error_dot;
  memory_.output = std::clamp(free, gains_.u_clamp_min, gains_.u_clamp_max);
  if (integrates && antiwindup_ != AntiWindup::legacy) integrate(integral_rate(error, free, memory_.output));
  return memory_.output;
}

}  // namespace doppel
