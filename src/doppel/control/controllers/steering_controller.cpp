#include "doppel/control/controllers/detail/steering_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/control/controllers/detail/parameter_value.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

constexpr double kStraightAhead = 1e-6;  // rad, of steering
constexpr double kRight = -1, kLeft = 1;
// The default of ros2_controllers, which is the indices of a diagonal and no variances.
const std::vector<double> kSteeringCovariance{0.0, 7.0, 14.0, 21.0, 28.0, 35.0};

void report_old_name(const ControllerContext& context, const std::string& old, const std::string& parameter) {
  log_diagnostic(*context.log, context.name,
                 {Severity::warning, "control.deprecated_parameter", fmt::format("'{}' is deprecated", old),
                  place_of(context, old), fmt::format("write {}", parameter)});
}

double side_of(std::size_t index, std::size_t count) {
  if (count == 1) return 0;
  return index == 0 ? kRight : kLeft;
}

}  // namespace

double SteeringGeometry::steering_for(double linear, double angular) const {
  const double angle = std::atan(angular * wheelbase / linear);
  return std::isfinite(angle) ? angle : 0.0;
}

double SteeringGeometry::traction_factor(double steering, double side) const {
  if (std::abs(steering) < kStraightAhead) return 1;
  const double radius_of_turn = wheelbase / std::tan(steering);
  return (radius_of_turn - side * traction_track / 2) / radius_of_turn;
}

double SteeringGeometry::wheel_angle(double steering, double side) const {
  return std::atan2(2 * wheelbase * std::sin(steering),
                    2 * wheelbase * std::cos(steering) - side * steering_track * std::sin(steering));
}

double SteeringGeometry::middle_angle(double wheel, double side) const {
  const double t = std::tan(wheel);
  return std::atan(wheelbase * t / (wheelbase + side * steering_track / 2 * t));
}

SteeringController::Names SteeringController::declare_names(ControllerContext& context,
                                                            const std::string& parameter,
                                                            const std::string& deprecated,
                                                            std::size_t expected) {
  Parameters& parameters = context.node->parameters();
  auto names = declare<Names>(parameters, context.overrides, parameter, {},
                              {"joints; of two, the right one first", true, {}});
  std::string used = parameter;
  if (const auto old = parameter_value<Names>(parameters, deprecated); !old.empty()) {
    report_old_name(context, deprecated, parameter);
    names = old;
    used = deprecated;
  }
  const bool optional = parameter.find("state") != std::string::npos;
  if (names.size() == expected || (optional && names.empty())) return names;
  refuse_base_parameter(context, used,
                        fmt::format("has {} joints, but this base has {}", names.size(), expected),
                        expected == 1 ? "list one joint" : "list the right and then the left joint");
}

void SteeringController::declare_joints(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  front_steering_ = declare<bool>(parameters, context.overrides, "front_steering", true,
                                  {"deprecated: which of the deprecated lists is steered", true, {}});
  if (!front_steering_)
    report_old_name(context, "front_steering", "traction_joints_names and steering_joints_names");
  for (const char* old :
       {"front_wheels_names", "rear_wheels_names", "front_wheels_state_names", "rear_wheels_state_names"})
    declare<Names>(parameters, context.overrides, old, {}, {"deprecated", true, {}});
  const std::string driven_end = front_steering_ ? "rear" : "front",
                    steered_end = front_steering_ ? "front" : "rear";
  traction_ = declare_names(context, "traction_joints_names", driven_end + "_wheels_names", driven());
  steering_ = declare_names(context, "steering_joints_names", steered_end + "_wheels_names", steered());
  traction_states_ =
      declare_names(context, "traction_joints_state_names", driven_end + "_wheels_state_names", driven());
  steering_states_ =
      declare_names(context, "steering_joints_state_names", steered_end + "_wheels_state_names", steered());
  declare_driven_joints(context, "traction_joints_names", traction_);
  declare_driven_joints(context, "steering_joints_names", steering_);
  if (traction_states_.empty()) traction_states_ = traction_;
  if (steering_states_.empty()) steering_states_ = steering_;
}

double SteeringController::declare_length(ControllerContext& context, const std::string& parameter,
                                          const std::vector<std::string>& deprecated, bool required) {
  Parameters& parameters = context.node->parameters();
  double length =
      declare<double>(parameters, context.overrides, parameter, 0.0, {"m", true, check_positive_or_zero});
  for (const std::string& old : deprecated) {
    if (parameters.find(old) == nullptr)
      declare<double>(parameters, context.overrides, old, 0.0, {"deprecated", true, check_positive_or_zero});
    const double value = parameter_value<double>(parameters, old);
    if (value <= 0) continue;
    report_old_name(context, old, parameter);
    length = value;
  }
  if (required && length <= 0) refuse_base_parameter(context, parameter, "is not set", "write it in metres");
  return length;
}

void SteeringController::declare_geometry(ControllerContext& context) {
  const bool one = geometry_.kind == SteeringKind::bicycle;
  const std::string wheels = one ? "wheel" : "wheels";
  geometry_.wheelbase = declare_length(context, "wheelbase", {}, true);
  geometry_.radius =
      declare_length(context, fmt::format("traction_{}_radius", wheels),
                     {fmt::format("front_{}_radius", wheels), fmt::format("rear_{}_radius", wheels)}, true);
  if (geometry_.kind == SteeringKind::tricycle)
    geometry_.traction_track = declare_length(context, "traction_track_width", {"wheel_track"}, true);
  if (geometry_.kind != SteeringKind::ackermann) return;
  const char* driven_end = front_steering_ ? "rear_wheel_track" : "front_wheel_track";
  const char* steered_end = front_steering_ ? "front_wheel_track" : "rear_wheel_track";
  geometry_.traction_track = declare_length(context, "traction_track_width", {driven_end}, true);
  geometry_.steering_track = declare_length(context, "steering_track_width", {steered_end}, false);
  if (geometry_.steering_track <= 0) geometry_.steering_track = geometry_.traction_track;
}

void SteeringController::on_init(ControllerContext& context) {
  declare_base(context, 1.0,
               {.odometry = "~/odometry",
                .transform = "~/tf_odometry",
                .covariance = kSteeringCovariance,
                .has_prefix = false,
                .has_rate = false});
  declare_joints(context);
  declare_geometry(context);
  Parameters& parameters = context.node->parameters();
  ParameterOverrides* written = context.overrides;
  declare<bool>(parameters, written, "open_loop", false, {"odometry from the references", false, {}});
  declare<bool>(parameters, written, "position_feedback", false,
                {"odometry from positions of the driven wheels, else from velocities", false, {}});
  declare<bool>(parameters, written, "reduce_wheel_speed_until_steering_reached", false,
                {"drive slower while the steering turns", false, {}});
  declare<std::int64_t>(
      parameters, written, "velocity_rolling_window_size", 10,
      {.description = "velocities in the mean of the odometry", .range = ParameterRange{1, 10000}});
  for (const char* name : {"pose_covariance_diagonal", "twist_covariance_diagonal"}) {
    if (written != nullptr && written->find(name) != nullptr) continue;
    context.log->note(context.name,
                      fmt::format("'{}' has the default of ros2_controllers, [0, 7, 14, 21, 28, 35]: "
                                  "write variances for state estimators",
                                  name));
  }
  state_topic_ = context.node->advertise<control_msgs::msg::SteeringControllerStatus>(
      "~/controller_state", Qos::system_default_publisher());
}

Status SteeringController::on_configure() {
  const Parameters& parameters = context_->node->parameters();
  open_loop_ = parameter_value<bool>(parameters, "open_loop");
  position_feedback_ = parameter_value<bool>(parameters, "position_feedback");
  waits_for_steering_ = parameter_value<bool>(parameters, "reduce_wheel_speed_until_steering_reached");
  last_.assign(driven(), kNaN);
  steering_angle_ = 0;
  (position_feedback_ ? state_.traction_wheels_position : state_.traction_wheels_velocity)
      .assign(driven(), 0.0);
  (position_feedback_ ? state_.traction_wheels_velocity : state_.traction_wheels_position).clear();
  state_.linear_velocity_command.assign(driven(), 0.0);
  state_.steer_positions.assign(steered(), 0.0);
  state_.steering_angle_command.assign(steered(), 0.0);
  state_.header.frame_id = parameter_value<std::string>(parameters, "odom_frame_id");
  return configure_base(
      static_cast<std::size_t>(parameter_value<std::int64_t>(parameters, "velocity_rolling_window_size")));
}

InterfaceConfiguration SteeringController::command_interfaces() const {
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  for (const std::string& joint : traction_) wanted.names.push_back(joint + "/" + kVelocity);
  for (const std::string& joint : steering_) wanted.names.push_back(joint + "/" + kPosition);
  return wanted;
}

InterfaceConfiguration SteeringController::state_interfaces() const {
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  const std::string feedback = position_feedback_ ? kPosition : kVelocity;
  for (const std::string& joint : traction_states_) wanted.names.push_back(joint + "/" + feedback);
  for (const std::string& joint : steering_states_) wanted.names.push_back(joint + "/" + kPosition);
  return wanted;
}

std::vector<std::string> SteeringController::reference_interfaces() const {
  return {std::string("linear/") + kVelocity, std::string("angular/") + kVelocity};
}

std::optional<PlanarVelocity> SteeringController::reference() const {
  const double linear = reference_handles[0].get(), angular = reference_handles[1].get();
  if (!std::isfinite(linear) || !std::isfinite(angular)) return std::nullopt;
  return PlanarVelocity{linear, 0, angular};
}

void SteeringController::write_reference(const geometry_msgs::msg::Twist& twist) {
  reference_handles[0].set(twist.linear.x);
  reference_handles[1].set(twist.angular.z);
}

void SteeringController::measure(const std::optional<PlanarVelocity>& reference, double dt) {
  double steering = 0;
  for (std::size_t i = 0; i < steered(); ++i) {
    const double angle = state_handles[driven() + i].get();
    steering += steered() == 1 ? angle : geometry_.middle_angle(angle, side_of(i, 2)) / 2;
  }
  if (std::isfinite(steering)) steering_angle_ = steering;
  if (open_loop_) {
    odometry_.move_exactly(reference.value_or(PlanarVelocity{}), dt);
    return;
  }
  double linear = 0;  // the mean of what each wheel gives
  for (std::size_t i = 0; i < driven(); ++i) {
    double speed = state_handles[i].get();
    if (position_feedback_) {
      const double position = speed;
      speed = std::isnan(last_[i]) ? 0.0 : (position - last_[i]) / dt;
      last_[i] = position;
    }
    linear += speed * geometry_.radius / geometry_.traction_factor(steering, side_of(i, driven())) /
              static_cast<double>(driven());
  }
  if (!std::isfinite(linear) || !std::isfinite(steering)) return;
  odometry_.move({linear, 0, std::tan(steering) * linear / geometry_.wheelbase}, dt);
}

void SteeringController::command(const PlanarVelocity& reference, double /*dt*/) {
  const double wanted = geometry_.steering_for(reference.x, reference.yaw);
  // The speeds of the driven wheels follow the steering that is, so that no wheel scrubs while it turns.
  const double present = open_loop_ ? wanted : steering_angle_;
  double speed = reference.x / geometry_.radius;
  if (waits_for_steering_ && !open_loop_) {
    constexpr double kNear = std::numbers::pi / 6, kFar = 1.5608;  // rad, as in ros2_controllers
    const double error = std::abs(present - wanted);
    if (error >= kNear) speed *= std::cos(std::min(error, kFar)) / std::cos(kNear);
  }
  for (std::size_t i = 0; i < driven(); ++i)
    command_handles[i].set(speed * geometry_.traction_factor(present, side_of(i, driven())));
  for (std::size_t i = 0; i < steered(); ++i)
    command_handles[driven() + i].set(steered() == 1 ? wanted : geometry_.wheel_angle(wanted, side_of(i, 2)));
}

void SteeringController::stop_wheels() {
  for (std::size_t i = 0; i < driven(); ++i) command_handles[i].set(0.0);
}

void SteeringController::publish_state(Time now) {
  if (!state_topic_.has_listeners()) return;
  state_.header.stamp = to_time_msg(context_->node->bus().stamp(now));
  auto& feedback = position_feedback_ ? state_.traction_wheels_position : state_.traction_wheels_velocity;
  for (std::size_t i = 0; i < driven(); ++i) {
    feedback[i] = state_handles[i].get();
    state_.linear_velocity_command[i] = command_handles[i].get();
  }
  for (std::size_t i = 0; i < steered(); ++i) {
    state_.steer_positions[i] = state_handles[driven() + i].get();
    state_.steering_angle_command[i] = command_handles[driven() + i].get();
  }
  state_topic_.publish(state_, now);
}

}  // namespace doppel
