#include "doppel/control/controllers/detail/tricycle_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/control/controllers/detail/parameter_value.h"
#include "doppel/control/controllers/detail/reference_base.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

constexpr const char *kTractionJoint = "traction_joint_name", *kSteeringJoint = "steering_joint_name",
                     *kTricycleTimeout = "cmd_vel_timeout", *kTricycleWindow = "velocity_rolling_window_size",
                     *kPublishAckermann = "publish_ackermann_command";
constexpr double kFullSpeedBelow = std::numbers::pi / 6;  // rad, between the present and the wanted angle
constexpr double kLeastScale = 0.01;                      // of the speed, beyond a right angle

constexpr const char* kTractionLimits[] = {"velocity", "acceleration", "deceleration", "jerk"};
constexpr const char* kSteeringLimits[] = {"position", "velocity", "acceleration"};

}  // namespace

void TricycleController::declare_wheel(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  for (const char* name : {kTractionJoint, kSteeringJoint}) {
    const auto joint =
        declare<std::string>(parameters, context.overrides, name, "", {"joint of the wheel", false, {}});
    if (joint.empty()) refuse_base_parameter(context, name, "is not set", "write the joint of the wheel");
    (name == kTractionJoint ? traction_ : steering_) = declare_driven_joints(context, name, {joint}).front();
  }
  for (const char* name : {"wheelbase", "wheel_radius"}) {
    const double size =
        declare<double>(parameters, context.overrides, name, 0.0, {"m", false, check_positive});
    if (size <= 0) refuse_base_parameter(context, name, "is not set", "write it in metres");
  }
}

void TricycleController::declare_limits(ControllerContext& context) {
  const auto declare_both = [&](const char* group, const char* limit, const char* description) {
    for (const char* end : {"min", "max"})
      declare<double>(context.node->parameters(), context.overrides,
                      fmt::format("{}.{}_{}", group, end, limit), kNaN, {description, false, {}});
  };
  for (const char* limit : kTractionLimits)
    declare_both("traction", limit, "magnitude, of the wheel in rad/s and its derivatives; NaN: none");
  for (const char* limit : kSteeringLimits)
    declare_both("steering", limit, "of the steering in rad and its derivatives; NaN: none");
}

void TricycleController::on_init(ControllerContext& context) {
  context_ = &context;
  declare_wheel(context);
  declare_limits(context);
  Parameters& parameters = context.node->parameters();
  ParameterOverrides* written = context.overrides;
  declare<bool>(parameters, written, "open_loop", false,
                {"odometry from the commands, not from feedback", false, {}});
  declare<bool>(parameters, written, kPublishAckermann, false, {"on ~/cmd_ackermann", false, {}});
  const auto not_negative = [](const ParameterValue& value) {
    return std::get<std::int64_t>(value) >= 0 ? Status{} : Status::refused("it must be at least 0");
  };
  declare<std::int64_t>(parameters, written, kTricycleTimeout, 500,
                        {"ms, after which the base brakes without a new command", false, not_negative});
  declare<std::int64_t>(
      parameters, written, kTricycleWindow, 10,
      {.description = "velocities in the mean of the odometry", .range = ParameterRange{1, 10000}});
  publisher_.declare(
      context, {.has_prefix = false, .has_rate = false, .has_only_twist = true, .sends_transform = false});
  context.node->subscribe<geometry_msgs::msg::TwistStamped>(
      "~/cmd_vel",
      [this](const auto& message) {
        if (active_) command_.receive(message);
      },
      Qos::system_default_subscription());
  context.node->serve<std_srvs::srv::Empty>("~/reset_odometry",
                                            [this](const auto& /*request*/, auto respond) {
                                              odometry_.reset();
                                              respond({});
                                            });
}

Status TricycleController::read_limits() {
  const Parameters& parameters = context_->node->parameters();
  const auto range = [&](const char* group, const char* limit) {
    return MagnitudeRange{parameter_value<double>(parameters, fmt::format("{}.min_{}", group, limit)),
                          parameter_value<double>(parameters, fmt::format("{}.max_{}", group, limit))};
  };
  TractionLimits traction{range("traction", "velocity"), range("traction", "acceleration"),
                          range("traction", "deceleration"), range("traction", "jerk")};
  const MagnitudeRange position = range("steering", "position");
  SteeringLimits steering{position.min, position.max, range("steering", "velocity"),
                          range("steering", "acceleration")};
  if (Status fine = traction.complete(); !fine) return fine;
  if (Status fine = steering.complete(); !fine) return fine;
  traction_limits_ = traction;
  steering_limits_ = steering;
  return {};
}

Status TricycleController::on_configure() {
  const Parameters& parameters = context_->node->parameters();
  if (Status fine = read_limits(); !fine) return fine;
  if (Status fine = publisher_.configure(); !fine) return fine;
  wheelbase_ = parameter_value<double>(parameters, "wheelbase");
  wheel_radius_ = parameter_value<double>(parameters, "wheel_radius");
  open_loop_ = parameter_value<bool>(parameters, "open_loop");
  const auto timeout = std::chrono::milliseconds(parameter_value<std::int64_t>(parameters, kTricycleTimeout));
  // 0 is no time at all there, not "never".
  command_.configure(*context_, kTricycleTimeout, std::max<Duration>(timeout, Duration{1}));
  odometry_.set_window(static_cast<std::size_t>(parameter_value<std::int64_t>(parameters, kTricycleWindow)));
  odometry_.reset();
  if (parameter_value<bool>(parameters, kPublishAckermann) && !ackermann_topic_) {
    ackermann_topic_ = context_->node->advertise<ackermann_msgs::msg::AckermannDrive>(
        "~/cmd_ackermann", Qos::system_default_publisher());
  }
  return {};
}

InterfaceConfiguration TricycleController::command_interfaces() const {
  return {InterfaceConfiguration::Kind::individual,
          {traction_ + "/" + kVelocity, steering_ + "/" + kPosition}};
}

InterfaceConfiguration TricycleController::state_interfaces() const {
  return command_interfaces();
}

Status TricycleController::on_activate() {
  command_.forget(context_->node->bus().now());
  speeds_ = {};
  angles_ = {};
  active_ = true;
  invalid_state_ = invalid_state_reported_ = false;
  return {};
}

Status TricycleController::on_deactivate() {
  active_ = false;
  for (CommandHandle& command : command_handles) command.set(0.0);
  return {};
}

TricycleController::WheelCommand TricycleController::wheel_for(double linear, double angular) const {
  if (linear == 0 && angular != 0)
    return {std::copysign(std::numbers::pi / 2, angular), std::abs(angular) * wheelbase_ / wheel_radius_};
  const double angle = linear == 0 ? 0 : std::atan(angular * wheelbase_ / linear);
  return {angle, linear / (wheel_radius_ * std::cos(angle))};
}

void TricycleController::update(Time now, Duration period) {
  const double dt = to_seconds(period);
  const double speed = state_handles[0].get(), angle = state_handles[1].get();
  const geometry_msgs::msg::Twist& twist = command_.twist();
  const bool commanded = !command_.is_stale(now) && std::isfinite(twist.linear.x + twist.angular.z);
  const double linear = commanded ? twist.linear.x : 0, angular = commanded ? twist.angular.z : 0;
  invalid_state_ = !std::isfinite(speed + angle);
  if (invalid_state_) {
    for (CommandHandle& command : command_handles) command.set(0.0);
    return;
  }
  if (open_loop_) {
    odometry_.move_exactly({linear, 0, angular}, dt);
  } else {
    const double along = speed * wheel_radius_;  // of the wheel, m/s
    odometry_.move({along * std::cos(angle), 0, along * std::sin(angle) / wheelbase_}, dt);
  }
  publisher_.publish(now, odometry_);
  WheelCommand wheel = wheel_for(linear, angular);
  if (const double missing = std::abs(wheel.angle - angle); missing >= kFullSpeedBelow)
    wheel.speed *= missing > std::numbers::pi / 2 ? kLeastScale : std::cos(missing);
  wheel.speed = traction_limits_.limit(wheel.speed, speeds_, dt);
  wheel.angle = steering_limits_.limit(wheel.angle, angles_, dt);
  speeds_.push(wheel.speed);
  angles_.push(wheel.angle);
  command_handles[0].set(wheel.speed);
  command_handles[1].set(wheel.angle);
  if (!ackermann_topic_ || !ackermann_topic_->has_listeners()) return;
  ackermann_msgs::msg::AckermannDrive message;  // its speed is that of the wheel, as in ros2_controllers
  message.steering_angle = static_cast<float>(wheel.angle);
  message.speed = static_cast<float>(wheel.speed);
  ackermann_topic_->publish(message, now);
}

void TricycleController::housekeeping(Time now) {
  command_.report_braking(now);
  if (!invalid_state_ || invalid_state_reported_) return;
  invalid_state_reported_ = true;
  context_->log->error(context_->name,
                       "a state of the wheel is not a number: it stops, and the odometry is not updated");
}

}  // namespace doppel
