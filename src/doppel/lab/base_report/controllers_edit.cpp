// Multipliers in the text of a controllers' file, with its comments and order.

#include <fmt/format.h>

#include <string>

#include "doppel/lab/base_report/base_report.h"
#include "doppel/ros/bus/parameter_edit.h"

namespace doppel {

std::string with_multipliers(const std::string& text, const std::filesystem::path& file,
                             const std::string& controller, const BaseMultipliers& multipliers) {
  // A new line is added below that of the track, which every such controller has.
  const auto edit = [&](const char* name, double value) {
    return NumberEdit{controller, name, fmt::format("{:.4f}", value), "wheel_separation"};
  };
  return with_numbers(text, file.string(),
                      {edit("wheel_separation_multiplier", multipliers.separation),
                       edit("left_wheel_radius_multiplier", multipliers.left_radius),
                       edit("right_wheel_radius_multiplier", multipliers.right_radius)},
                      "base.not_editable");
}

}  // namespace doppel
