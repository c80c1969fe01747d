// Names and units of the fitted values, and what may be written of them.
#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/review/identification/servo_fit.h"

namespace doppel {

double estimate_tick(std::span<const double> positions) {
  double least = 1e300;
  for (std::size_t i = 1; i < positions.size(); ++i) {
    const double d = std::abs(positions[i] - positions[i - 1]);
    if (d > 1e-9) least = std::min(least, d);
  }
  if (least > 1e299) return 0;
  // Differences that are multiples of the least one within rounding.
  double sum = 0, count = 0, off = 0;
  for (std::size_t i = 1; i < positions.size(); ++i) {
    const double d = std::abs(positions[i] - positions[i - 1]) / least;
    if (d < 0.5 || d > 50) continue;
    off = std::max(off, std::abs(d - std::round(d)));
    sum += d / std::round(d) * least;
    count += 1;
  }
  return count > 10 && off < 0.1 ? sum / count : 0;
}

bool ServoFit::is_identified(ServoQuantity quantity) const {
  const FittedValue& value = (*this)[quantity];
  return value.fitted && value.problem.empty() && std::ranges::find(at_bound, quantity) == at_bound.end();
}

bool ServoFit::is_trusted(ServoQuantity quantity) const {
  return is_white && is_identified(quantity);
}

std::string_view name_of(ServoQuantity quantity) {
  constexpr std::array<std::string_view, kServoQuantities> kNames{
      "delay",   "velocity", "effort",    "stiffness", "damping",     "armature",
      "viscous", "friction", "breakaway", "stribeck",  "load_factor", "backlash"};
  return kNames[static_cast<std::size_t>(quantity)];
}

std::string unit_of(ServoQuantity quantity, bool slides) {
  switch (quantity) {
    case ServoQuantity::delay:
      return "s";
    case ServoQuantity::velocity:
    case ServoQuantity::stribeck:
      return slides ? "m/s" : "rad/s";
    case ServoQuantity::effort:
    case ServoQuantity::friction:
    case ServoQuantity::breakaway:
      return slides ? "N" : "N m";
    case ServoQuantity::stiffness:
      return slides ? "N/m" : "N m/rad";
    case ServoQuantity::damping:
    case ServoQuantity::viscous:
      return slides ? "N s/m" : "N m s/rad";
    case ServoQuantity::armature:
      return slides ? "kg" : "kg m^2";
    case ServoQuantity::load_factor:
      return "1";
    case ServoQuantity::backlash:
      return slides ? "m" : "rad";
  }
  return "";
}

std::string_view name_of(FrictionRung rung) {
  constexpr std::array<std::string_view, kFrictionRungs> kNames{"M0", "M1", "M2", "M3", "M4"};
  return kNames[static_cast<std::size_t>(rung)];
}

}  // namespace doppel
