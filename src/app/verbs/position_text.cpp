#include "app/verbs/position_text.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <numbers>

#include "app/verbs/shell.h"

namespace doppel::app {

double parse_position(std::string_view number, std::string_view context) {
  std::string_view digits = number;
  if (digits.starts_with('+')) digits.remove_prefix(1);
  double value = 0;
  const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const std::string_view unit = digits.substr(static_cast<std::size_t>(end - digits.data()));
  const bool is_unit = unit.empty() || unit == "rad" || unit == "m" || unit == "deg";
  if (problem != std::errc() || !is_unit || !std::isfinite(value)) {
    throw_usage_error(fmt::format("'{}' is not a position in '{}'", number, context),
                      "write 1.2 (rad or m) or 90deg");
  }
  return unit == "deg" ? value * std::numbers::pi / 180 : value;
}

}  // namespace doppel::app
