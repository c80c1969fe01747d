#include "doppel/control/controllers/detail/diff_drive_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/controllers/detail/parameter_value.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

using Names = std::vector<std::string>;
constexpr const char *kLeftWheels = "left_wheel_names", *kRightWheels = "right_wheel_names";

Status check_not_zero(const ParameterValue& value) {
  const double factor = std::get<double>(value);
  if (std::isfinite(factor) && factor != 0) return {};
  return Status::refused("it must be a number other than 0");
}

[[noreturn]] void refuse_base(const ControllerContext& context, const char* parameter, const std::string& why,
                              const std::string& fix) {
  throw InputError("control.base_parameter", place_of(context, parameter),
                   fmt::format("controller '{}': '{}' {}", context.name, parameter, why), fix);
}

void declare_wheels(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  Names sides[2];
  for (const char* parameter : {kLeftWheels, kRightWheels}) {
    Names& names = sides[parameter == kRightWheels];
    names = declare<Names>(parameters, context.overrides, parameter, {},
                           {"joints of the wheels of one side", false, {}});
    if (names.empty())
      refuse_base(context, parameter, "is empty", "list the joints of that side's wheels: [a]");
  }
  if (sides[0].size() != sides[1].size()) {
    refuse_base(context, kRightWheels,
                fmt::format("has {} names, but '{}' has {}", sides[1].size(), kLeftWheels, sides[0].size()),
                "list as many wheels on each side");
  }
  for (const std::string& name : sides[1]) {
    if (std::find(sides[0].begin(), sides[0].end(), name) != sides[0].end())
      refuse_base(context, kRightWheels, fmt::format("lists '{}', which is also a left wheel", name),
                  "list each wheel on its own side");
  }
  for (const char* parameter : {kLeftWheels, kRightWheels}) {
    const Names& names = sides[parameter == kRightWheels];
    if (check_joints(context, parameter, names) != names)
      refuse_base(context, parameter, "lists a joint that mimics another and has no drive",
                  "list driven wheels only");
  }
}

void declare_size(ControllerContext& context, const char* parameter, const char* description) {
  const double size = declare<double>(context.node->parameters(), context.overrides, parameter, 0.0,
                                      {description, false, check_positive});
  if (size <= 0) refuse_base(context, parameter, "is not set", "write it in metres");
}

}  // namespace

void declare_diff_drive(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  ParameterOverrides* written = context.overrides;
  declare_wheels(context);
  declare_size(context, "wheel_separation", "m, between the wheels of both sides");
  declare_size(context, "wheel_radius", "m");
  declare<double>(parameters, written, "wheel_separation_multiplier", 1.0,
                  {"correction of the nominal value", false, check_positive});
  for (const char* factor : {"left_wheel_radius_multiplier", "right_wheel_radius_multiplier"}) {
    declare<double>(parameters, written, factor, 1.0,
                    {"correction of the nominal value; negative: the joints' axes point to the right", false,
                     check_not_zero});
  }
  declare<bool>(parameters, written, "open_loop", false,
                {"odometry from the commands, not from feedback", false, {}});
  declare<bool>(parameters, written, "position_feedback", true,
                {"odometry from positions of the wheels, else from velocities", false, {}});
  declare<double>(
      parameters, written, "cmd_vel_timeout", 0.5,
      {"s, after which the base brakes without a new command; 0: never", false, check_positive_or_zero});
  declare<bool>(parameters, written, "publish_limited_velocity", false, {"on ~/cmd_vel_out", false, {}});
  declare<std::int64_t>(
      parameters, written, "velocity_rolling_window_size", 10,
      {.description = "velocities in the mean of the odometry", .range = ParameterRange{1, 10000}});
}

bool declare_stamped_commands(ControllerContext& context) {
  constexpr const char* kStamped = "use_stamped_vel";
  const bool stamped =
      declare<bool>(context.node->parameters(), context.overrides, kStamped, true,
                    {"of ROS 2 Humble; false: reads Twist on ~/cmd_vel_unstamped", true, {}});
  const SourceLocation place = place_of(context, kStamped);
  if (place.known() && !place.file->starts_with('<')) {  // "<generated controllers>" is no file of the user
    log_diagnostic(
        *context.log, context.name,
        {Severity::warning, "control.deprecated_parameter",
         fmt::format("'{}' is of ROS 2 Humble: {}; Jazzy ignores it and reads TwistStamped on ~/cmd_vel",
                     kStamped, stamped ? "true has no effect" : "Twist is read on ~/cmd_vel_unstamped"),
         place, "remove it"});
  }
  return stamped;
}

DiffDriveSettings diff_drive_settings(const Parameters& parameters) {
  const auto number = [&](const char* name) { return parameter_value<double>(parameters, name); };
  const auto flag = [&](const char* name) { return parameter_value<bool>(parameters, name); };
  DiffDriveSettings settings;
  settings.left = parameter_value<Names>(parameters, kLeftWheels);
  settings.right = parameter_value<Names>(parameters, kRightWheels);
  settings.separation = number("wheel_separation") * number("wheel_separation_multiplier");
  settings.left_radius = number("wheel_radius") * number("left_wheel_radius_multiplier");
  settings.right_radius = number("wheel_radius") * number("right_wheel_radius_multiplier");
  settings.open_loop = flag("open_loop");
  settings.position_feedback = flag("position_feedback");
  settings.timeout = from_seconds(number("cmd_vel_timeout"));
  settings.publish_limited_velocity = flag("publish_limited_velocity");
  settings.window =
      static_cast<std::size_t>(parameter_value<std::int64_t>(parameters, "velocity_rolling_window_size"));
  return settings;
}

}  // namespace doppel
