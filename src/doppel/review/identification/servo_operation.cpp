#include "doppel/review/identification/servo_operation.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

namespace doppel {
namespace {

using Quantity = ServoQuantity;

constexpr std::array<std::pair<Quantity, std::optional<double> SetServo::*>, 9> kWritten{
    {{Quantity::stiffness, &SetServo::stiffness},
     {Quantity::damping, &SetServo::damping},
     {Quantity::armature, &SetServo::armature},
     {Quantity::friction, &SetServo::friction},
     {Quantity::viscous, &SetServo::viscous},
     {Quantity::effort, &SetServo::effort},
     {Quantity::velocity, &SetServo::velocity},
     {Quantity::delay, &SetServo::delay},
     {Quantity::backlash, &SetServo::backlash}}};

// Four significant digits: more than the interval of any value.
double rounded(double value) {
  if (!(value > 0)) return 0;
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 3);
  return std::stod(fmt::format("{:.4g}", std::round(value / unit) * unit));
}

std::string reason(const ServoFit& fit, Quantity quantity) {
  const FittedValue& value = fit[quantity];
  if (!value.problem.empty()) return value.problem;
  if (!fit.is_identified(quantity)) return "it is at the bound of its range";
  return fmt::format(
      "the residuals are not those of rounding, so that it may be wrong ({:.4g}, {:.4g} to {:.4g})",
      value.value, value.low, value.high);
}

}  // namespace

ServoWriting servo_operation(const std::string& joint, const ServoFit& fit, bool accept) {
  ServoWriting out;
  SetServo action;
  action.joint = joint;
  bool any = false;
  for (const auto& [quantity, member] : kWritten) {
    if (!fit[quantity].fitted) continue;
    if (!(accept ? fit.is_identified(quantity) : fit.is_trusted(quantity))) {
      out.left_out.push_back(fmt::format("{} is not written: {}", name_of(quantity), reason(fit, quantity)));
      continue;
    }
    action.*member = rounded(fit[quantity].value);
    any = true;
  }
  for (const Quantity quantity : {Quantity::breakaway, Quantity::stribeck, Quantity::load_factor}) {
    if (fit[quantity].fitted && any)
      out.left_out.push_back(fmt::format("{} is not written: no engine simulates it", name_of(quantity)));
  }
  if (!any) return out;
  if (fit.tick > 0) action.resolution = rounded(fit.tick);
  action.rms = rounded(fit.rms);
  out.evidence = fmt::format("rms {:.3g}, held out {:.3g} rad or m, model {}", fit.rms, fit.held_out_rms,
                             name_of(fit.rung));
  out.operation = std::move(action);
  return out;
}

}  // namespace doppel
