#include "doppel/control/controllers/detail/omni_wheel_drive_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "doppel/control/controllers/detail/parameter_value.h"
#include "doppel/control/controllers/detail/reference_base.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

constexpr const char *kOmniWheels = "wheel_names", *kOmniOffset = "wheel_offset",
                     *kOmniTimeout = "cmd_vel_timeout";
constexpr std::size_t kMinOmniWheels = 3;  // two of them cannot move a base in every direction

std::vector<std::string> declare_omni_wheels(ControllerContext& context) {
  auto joints = declare<std::vector<std::string>>(
      context.node->parameters(), context.overrides, kOmniWheels, {},
      {"joints of the wheels, anti-clockwise from the one at wheel_offset", true, {}});
  if (joints.size() < kMinOmniWheels) {
    refuse_base_parameter(
        context, kOmniWheels,
        fmt::format("has {} joints, but a base on omni wheels has three or more", joints.size()),
        "list all wheels, anti-clockwise from the one at wheel_offset");
  }
  if (std::set(joints.begin(), joints.end()).size() != joints.size())
    refuse_base_parameter(context, kOmniWheels, "lists a joint twice", "list each wheel once");
  return declare_driven_joints(context, kOmniWheels, joints);
}

}  // namespace

void OmniWheelDriveController::on_init(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  ParameterOverrides* written = context.overrides;
  joints_ = declare_omni_wheels(context);
  declare<double>(parameters, written, kOmniOffset, 0.0,
                  {"rad, from the base's x axis to the first wheel", true, {}});
  if (written == nullptr || written->find(kOmniOffset) == nullptr)
    refuse_base_parameter(context, kOmniOffset, "is not set",
                          "write the angle from the base's x axis to the first wheel, in radians");
  for (const char* name : {"robot_radius", "wheel_radius"}) {
    const double size = declare<double>(parameters, written, name, 0.0, {"m", true, check_positive});
    if (size <= 0) refuse_base_parameter(context, name, "is not set", "write it in metres");
  }
  declare<bool>(parameters, written, "open_loop", false,
                {"odometry from the commands, not from feedback", true, {}});
  declare<bool>(parameters, written, "position_feedback", true,
                {"odometry from positions of the wheels, else from velocities", true, {}});
  const double timeout = declare<double>(
      parameters, written, kOmniTimeout, 0.5,
      {"s, after which the base stops without a new command; 0: at once", true, check_positive_or_zero});
  if (timeout == 0) {
    log_diagnostic(
        *context.log, context.name,
        {Severity::warning, "control.base_parameter",
         fmt::format(
             "'{}' is 0, which this controller does not take as 'never': a command is used in one update "
             "at most",
             kOmniTimeout),
         place_of(context, kOmniTimeout), "write the time-out in seconds"});
  }
  declare_velocity_base(context,
                        {.pose_covariance = "diagonal_covariance.pose",
                         .twist_covariance = "diagonal_covariance.twist",
                         .has_rate = false},
                        true);
}

Status OmniWheelDriveController::on_configure() {
  const Parameters& parameters = context_->node->parameters();
  robot_radius_ = parameter_value<double>(parameters, "robot_radius");
  wheel_radius_ = parameter_value<double>(parameters, "wheel_radius");
  open_loop_ = parameter_value<bool>(parameters, "open_loop");
  position_feedback_ = parameter_value<bool>(parameters, "position_feedback");
  const double offset = parameter_value<double>(parameters, kOmniOffset);
  wheels_.clear();
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const double angle =
        offset + 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(joints_.size());
    wheels_.push_back({std::sin(angle), std::cos(angle), kNaN});
  }
  const Duration timeout = from_seconds(parameter_value<double>(parameters, kOmniTimeout));
  return configure_velocity_base({.timeout = std::max(timeout, Duration{1}), .open_loop = open_loop_});
}

InterfaceConfiguration OmniWheelDriveController::command_interfaces() const {
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  for (const std::string& joint : joints_) wanted.names.push_back(joint + "/" + kVelocity);
  return wanted;
}

InterfaceConfiguration OmniWheelDriveController::state_interfaces() const {
  if (open_loop_) return {};
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  const std::string feedback = position_feedback_ ? kPosition : kVelocity;
  for (const std::string& joint : joints_) wanted.names.push_back(joint + "/" + feedback);
  return wanted;
}

std::vector<std::string> OmniWheelDriveController::reference_interfaces() const {
  return {std::string("linear/x/") + kVelocity, std::string("linear/y/") + kVelocity,
          std::string("angular/z/") + kVelocity};
}

void OmniWheelDriveController::write_references(const geometry_msgs::msg::Twist& twist) {
  const double values[] = {twist.linear.x, twist.linear.y, twist.angular.z};
  if (!std::isfinite(values[0] + values[1] + values[2])) return;
  for (std::size_t i = 0; i < reference_handles.size(); ++i) reference_handles[i].set(values[i]);
}

PlanarVelocity OmniWheelDriveController::next_velocity(double /*dt*/) {
  return {reference_handles[0].get(), reference_handles[1].get(), reference_handles[2].get()};
}

// The least squares of all wheels: for even spacing the columns of the kinematics are orthogonal.
bool OmniWheelDriveController::measure(double dt) {
  PlanarVelocity sum;
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    Wheel& wheel = wheels_[i];
    double speed = state_handles[i].get();
    if (!std::isfinite(speed)) return false;
    if (position_feedback_) {
      const double position = speed;
      speed = std::isnan(wheel.last) ? 0.0 : (position - wheel.last) / dt;
      wheel.last = position;
    }
    sum.x += wheel.sine * speed;
    sum.y -= wheel.cosine * speed;
    sum.yaw -= speed;
  }
  const double scale = wheel_radius_ / static_cast<double>(wheels_.size());
  odometry_.move_exactly({2 * scale * sum.x, 2 * scale * sum.y, scale * sum.yaw / robot_radius_}, dt);
  return true;
}

void OmniWheelDriveController::drive(const PlanarVelocity& velocity) {
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const double along = wheels_[i].sine * velocity.x - wheels_[i].cosine * velocity.y;
    command_handles[i].set((along - robot_radius_ * velocity.yaw) / wheel_radius_);
  }
}

}  // namespace doppel
