#include "doppel/base/math/quantity.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

#include "doppel/base/math/units.h"

namespace doppel {
namespace {

struct Unit {
  std::string_view name;
  QuantityKind kind;
  double factor;
};
constexpr double kMillimetre = 1e-3, kCentimetre = 1e-2, kMillisecond = 1e-3, kPercent = 1e-2, kGram = 1e-3;
constexpr std::array<Unit, 19> kUnits = {{{"rad", QuantityKind::angle, 1},
                                          {"deg", QuantityKind::angle, kDegree},
                                          {"m", QuantityKind::length, 1},
                                          {"cm", QuantityKind::length, kCentimetre},
                                          {"mm", QuantityKind::length, kMillimetre},
                                          {"s", QuantityKind::time, 1},
                                          {"ms", QuantityKind::time, kMillisecond},
                                          {"%", QuantityKind::share, kPercent},
                                          {"kg", QuantityKind::mass, 1},
                                          {"g", QuantityKind::mass, kGram},
                                          {"m/s", QuantityKind::speed, 1},
                                          {"mm/s", QuantityKind::speed, kMillimetre},
                                          {"rad/s", QuantityKind::speed, 1},
                                          {"deg/s", QuantityKind::speed, kDegree},
                                          {"N", QuantityKind::force, 1},
                                          {"N/m", QuantityKind::stiffness, 1},
                                          {"N/mm", QuantityKind::stiffness, 1 / kMillimetre},
                                          {"V", QuantityKind::voltage, 1},
                                          {"A", QuantityKind::current, 1}}};

bool fits(QuantityKind unit, QuantityKind kind) {
  if (kind == QuantityKind::position) return unit == QuantityKind::angle || unit == QuantityKind::length;
  return unit == kind;
}

}  // namespace

std::optional<double> parse_quantity(const std::string& text, QuantityKind kind) {
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
  std::string_view unit(rest, static_cast<std::size_t>(end - rest));
  while (unit.starts_with(' ')) unit.remove_prefix(1);
  if (unit.empty()) return number;
  const auto* const found =
      std::ranges::find_if(kUnits, [&](const Unit& one) { return one.name == unit && fits(one.kind, kind); });
  if (found == kUnits.end() || !std::isfinite(number * found->factor)) return std::nullopt;
  return number * found->factor;
}

const char* example_of(QuantityKind kind) {
  constexpr std::array<const char*, 11> kExamples = {"0.5 rad, 30 deg or 20 mm",
                                                     "30 deg",
                                                     "50 mm",
                                                     "0.5 s",
                                                     "10 %",
                                                     "0.2 kg",
                                                     "250 mm/s",
                                                     "140 N",
                                                     "75 N/mm",
                                                     "5 V",
                                                     "10 A"};
  return kExamples[static_cast<std::size_t>(kind)];
}

}  // namespace doppel
