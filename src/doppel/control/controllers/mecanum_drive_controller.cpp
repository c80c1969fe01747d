#include "doppel/control/controllers/detail/mecanum_drive_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/controllers/detail/parameter_value.h"
#include "doppel/control/controllers/detail/speed_limit_parameters.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/hardware/nan.h"

namespace doppel {
namespace {

constexpr std::array<const char*, 4> kMecanumWheels{"front_left", "front_right", "rear_right", "rear_left"};
// Of each wheel: how its speed depends on the base's velocity to the left and on its turn.
constexpr std::array<double, 4> kAside{-1, 1, -1, 1}, kTurn{-1, 1, 1, -1};
constexpr std::array<const char*, 3> kMecanumComponents{"linear.x", "linear.y", "angular.z"};
constexpr const char* kReach = "kinematics.sum_of_robot_center_projection_on_X_Y_axis";

std::string joint_parameter(const char* wheel, const char* kind) {
  return fmt::format("{}_wheel_{}_joint_name", wheel, kind);
}

InterfaceConfiguration velocities_of(const std::array<std::string, 4>& joints) {
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  for (const std::string& joint : joints) wanted.names.push_back(joint + "/" + kVelocity);
  return wanted;
}

}  // namespace

void MecanumDriveController::declare_wheels(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  for (std::size_t i = 0; i < kMecanumWheels.size(); ++i) {
    const std::string name = joint_parameter(kMecanumWheels[i], "command");
    const auto joint =
        declare<std::string>(parameters, context.overrides, name, "", {"joint of the wheel", true, {}});
    if (joint.empty()) refuse_base_parameter(context, name, "is not set", "write the joint of that wheel");
    commanded_[i] = declare_driven_joints(context, name, {joint}).front();
    const auto state =
        declare<std::string>(parameters, context.overrides, joint_parameter(kMecanumWheels[i], "state"), "",
                             {"joint whose velocity is read; empty: the commanded one", true, {}});
    measured_[i] = state.empty() ? joint : state;
    const auto first = std::find(commanded_.begin(), commanded_.end(), joint);
    if (first != commanded_.begin() + static_cast<std::ptrdiff_t>(i))
      refuse_base_parameter(context, name, fmt::format("is '{}', which is another wheel, too", joint),
                            "write the joint of that wheel");
  }
}

void MecanumDriveController::on_init(ControllerContext& context) {
  declare_base(context, 0.0,
               {.odometry = "~/odometry",
                .transform = "~/tf_odometry",
                .covariance = std::vector<double>(6, 0.1),
                .has_rate = false});
  declare_wheels(context);
  Parameters& parameters = context.node->parameters();
  for (const char* name : {"kinematics.wheels_radius", kReach}) {
    const double size =
        declare<double>(parameters, context.overrides, name, 0.0, {"m", true, check_positive});
    if (size <= 0) refuse_base_parameter(context, name, "is not set", "write it in metres");
  }
  for (const char* part : {"x", "y", "theta"}) {
    declare<double>(parameters, context.overrides, fmt::format("kinematics.base_frame_offset.{}", part), 0.0,
                    {"of the base's frame in that of the wheels' centre, m or rad", true, {}});
  }
  for (const char* component : kMecanumComponents)
    declare_speed_limits(context, component, DeprecatedLimits::absent);
  state_topic_ = context.node->advertise<control_msgs::msg::MecanumDriveControllerState>(
      "~/controller_state", Qos::system_default_publisher());
}

Status MecanumDriveController::on_configure() {
  const Parameters& parameters = context_->node->parameters();
  const auto number = [&](const char* name) { return parameter_value<double>(parameters, name); };
  radius_ = number("kinematics.wheels_radius");
  reach_ = number(kReach);
  offset_ = {number("kinematics.base_frame_offset.x"), number("kinematics.base_frame_offset.y"),
             number("kinematics.base_frame_offset.theta")};
  for (std::size_t i = 0; i < limiters_.size(); ++i) {
    if (Status fine = limiters_[i].set(speed_limits(parameters, kMecanumComponents[i])); !fine) return fine;
  }
  state_.header.frame_id = parameter_value<std::string>(parameters, "odom_frame_id");
  return configure_base(1);
}

InterfaceConfiguration MecanumDriveController::command_interfaces() const {
  return velocities_of(commanded_);
}

InterfaceConfiguration MecanumDriveController::state_interfaces() const {
  return velocities_of(measured_);
}

std::vector<std::string> MecanumDriveController::reference_interfaces() const {
  return {std::string("linear/x/") + kVelocity, std::string("linear/y/") + kVelocity,
          std::string("angular/z/") + kVelocity};
}

std::optional<PlanarVelocity> MecanumDriveController::reference() const {
  const PlanarVelocity wanted{reference_handles[0].get(), reference_handles[1].get(),
                              reference_handles[2].get()};
  if (!std::isfinite(wanted.x + wanted.y + wanted.yaw)) return std::nullopt;
  return wanted;
}

void MecanumDriveController::write_reference(const geometry_msgs::msg::Twist& twist) {
  reference_handles[0].set(twist.linear.x);
  reference_handles[1].set(twist.linear.y);
  reference_handles[2].set(twist.angular.z);
}

void MecanumDriveController::measure(const std::optional<PlanarVelocity>& /*reference*/, double dt) {
  PlanarVelocity centre;
  for (std::size_t i = 0; i < state_handles.size(); ++i) {
    const double speed = state_handles[i].get() * radius_ / 4;
    centre.x += speed;
    centre.y += kAside[i] * speed;
    centre.yaw += kTurn[i] * speed / reach_;
  }
  if (!std::isfinite(centre.x)) return;
  const double c = std::cos(offset_.yaw), s = std::sin(offset_.yaw);
  const double x = centre.x - centre.yaw * offset_.y,
               y = centre.y + centre.yaw * offset_.x;  // at the base's frame
  odometry_.move_exactly({c * x + s * y, -s * x + c * y, centre.yaw}, dt);
}

void MecanumDriveController::command(const PlanarVelocity& reference, double dt) {
  const double x = limiters_[0].limit(reference.x, dt), y = limiters_[1].limit(reference.y, dt);
  const double yaw = limiters_[2].limit(reference.yaw, dt);
  const double c = std::cos(offset_.yaw), s = std::sin(offset_.yaw);
  const double ahead = c * x - s * y + offset_.y * yaw, aside = s * x + c * y - offset_.x * yaw;
  for (std::size_t i = 0; i < command_handles.size(); ++i)
    command_handles[i].set((ahead + kAside[i] * aside + kTurn[i] * reach_ * yaw) / radius_);
}

void MecanumDriveController::stop_wheels() {
  for (CommandHandle& wheel : command_handles) wheel.set(0.0);
}

void MecanumDriveController::rest() {
  for (SpeedLimiter& limiter : limiters_) limiter.reset();
}

void MecanumDriveController::publish_state(Time now) {
  if (!state_topic_.has_listeners()) return;
  state_.header.stamp = to_time_msg(context_->node->bus().stamp(now));
  state_.front_left_wheel_velocity = state_handles[0].get();
  state_.front_right_wheel_velocity = state_handles[1].get();
  state_.back_right_wheel_velocity = state_handles[2].get();
  state_.back_left_wheel_velocity = state_handles[3].get();
  state_.reference_velocity.linear.x = reference_handles[0].get();
  state_.reference_velocity.linear.y = reference_handles[1].get();
  state_.reference_velocity.angular.z = reference_handles[2].get();
  state_topic_.publish(state_, now);
}

}  // namespace doppel
