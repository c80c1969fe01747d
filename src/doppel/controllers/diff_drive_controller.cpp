#include "doppel/controllers/detail/diff_drive_controller.h"

#include <algorithm>
#include <cmath>

#include "doppel/control/hardware.h"
#include "doppel/controllers/detail/speed_limit_parameters.h"
#include "doppel/messages/control_msgs.h"

namespace doppel {
namespace {

constexpr const char *kLinear = "linear.x", *kAngular = "angular.z";

}  // namespace

void DiffDriveController::on_init(ControllerContext& context) {
  context_ = &context;
  declare_diff_drive(context);
  declare_speed_limits(context, kLinear);
  declare_speed_limits(context, kAngular);
  publisher_.declare(context, {});
  Node& node = *context.node;
  const auto receive = [this](const auto& message) {
    if (active_ && !chained_) command_.receive(message);
  };
  const Qos qos = Qos::system_default_subscription();
  if (declare_stamped_commands(context)) {
    node.subscribe<geometry_msgs::msg::TwistStamped>("~/cmd_vel", receive, qos);
  } else {
    node.subscribe<geometry_msgs::msg::Twist>("~/cmd_vel_unstamped", receive, qos);
  }
  node.serve<control_msgs::srv::SetOdometry>("~/set_odometry", [this](const auto& request, auto respond) {
    if (!active_) return respond({false, "the controller is not active"});
    odometry_.reset({request.x, request.y, request.yaw});
    respond({true, "the odometry is set"});
  });
}

Status DiffDriveController::on_configure() {
  const Parameters& parameters = context_->node->parameters();
  settings_ = diff_drive_settings(parameters);
  if (settings_.left.size() != settings_.right.size())
    return Status::refused("left_wheel_names and right_wheel_names differ in number");
  if (Status fine = linear_limiter_.set(speed_limits(parameters, kLinear)); !fine) return fine;
  if (Status fine = angular_limiter_.set(speed_limits(parameters, kAngular)); !fine) return fine;
  if (Status fine = publisher_.configure(); !fine) return fine;
  if (settings_.publish_limited_velocity && !limited_topic_) {
    limited_topic_ = context_->node->advertise<geometry_msgs::msg::TwistStamped>(
        "~/cmd_vel_out", Qos::system_default_publisher());
  }
  command_.configure(*context_, "cmd_vel_timeout", settings_.timeout);
  odometry_.set_window(settings_.window);
  odometry_.reset();
  last_left_ = last_right_ = kNaN;
  return {};
}

InterfaceConfiguration DiffDriveController::command_interfaces() const {
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  for (const auto* side : {&settings_.left, &settings_.right}) {
    for (const std::string& wheel : *side) wanted.names.push_back(wheel + "/" + kVelocity);
  }
  return wanted;
}

InterfaceConfiguration DiffDriveController::state_interfaces() const {
  if (settings_.open_loop) return {};
  InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
  const std::string feedback = settings_.position_feedback ? kPosition : kVelocity;
  for (const auto* side : {&settings_.left, &settings_.right}) {
    for (const std::string& wheel : *side) wanted.names.push_back(wheel + "/" + feedback);
  }
  return wanted;
}

std::vector<std::string> DiffDriveController::reference_interfaces() const {
  return {std::string("linear/") + kVelocity, std::string("angular/") + kVelocity};
}

// No reference, no history of the limiters and no command: what was commanded before does not come back.
void DiffDriveController::rest() {
  for (CommandHandle& reference : reference_handles) reference.set(kNaN);
  linear_limiter_.reset();
  angular_limiter_.reset();
  command_.forget(context_->node->bus().now());
}

Status DiffDriveController::on_activate() {
  rest();
  active_ = true;
  chained_ = invalid_state_ = invalid_state_reported_ = false;
  return {};
}

Status DiffDriveController::on_deactivate() {
  active_ = false;
  for (CommandHandle& wheel : command_handles) wheel.set(0.0);
  rest();
  return {};
}

// The base brakes: neither a former leader's references nor a former command are continued.
void DiffDriveController::set_chained_mode(bool chained) {
  chained_ = chained;
  command_.forget(context_->node->bus().now());
  for (CommandHandle& reference : reference_handles) {
    if (std::isfinite(reference.get())) reference.set(0.0);
  }
}

void DiffDriveController::take_references(Time now) {
  if (command_.is_stale(now)) {
    for (CommandHandle& reference : reference_handles) reference.set(0.0);
    return;
  }
  const double linear = command_.twist().linear.x, angular = command_.twist().angular.z;
  if (!std::isfinite(linear) || !std::isfinite(angular)) return;
  reference_handles[0].set(linear);
  reference_handles[1].set(angular);
}

std::optional<double> DiffDriveController::mean_of_side(std::size_t first) const {
  double sum = 0;
  const std::size_t wheels = settings_.left.size();
  for (std::size_t i = first; i < first + wheels; ++i) sum += state_handles[i].get();
  if (!std::isfinite(sum)) return std::nullopt;
  return sum / static_cast<double>(wheels);
}

bool DiffDriveController::measure(double dt) {
  const auto left = mean_of_side(0), right = mean_of_side(settings_.left.size());
  if (!left || !right) return false;
  double left_speed = *left * settings_.left_radius, right_speed = *right * settings_.right_radius;
  if (settings_.position_feedback) {
    const bool first = std::isnan(last_left_);
    left_speed = first ? 0 : (*left - last_left_) * settings_.left_radius / dt;
    right_speed = first ? 0 : (*right - last_right_) * settings_.right_radius / dt;
    last_left_ = *left;
    last_right_ = *right;
  }
  odometry_.move({(left_speed + right_speed) / 2, 0, (right_speed - left_speed) / settings_.separation}, dt);
  return true;
}

void DiffDriveController::drive(double linear, double angular) {
  const double aside = angular * settings_.separation / 2;
  const double left = (linear - aside) / settings_.left_radius,
               right = (linear + aside) / settings_.right_radius;
  const std::size_t wheels = settings_.left.size();
  for (std::size_t i = 0; i < wheels; ++i) {
    command_handles[i].set(left);
    command_handles[wheels + i].set(right);
  }
}

void DiffDriveController::publish_limited(Time now, double linear, double angular) {
  if (!limited_topic_ || !settings_.publish_limited_velocity || !limited_topic_->has_listeners()) return;
  limited_.header.stamp = to_time_msg(context_->node->bus().stamp(now));
  limited_.twist.linear.x = linear;
  limited_.twist.angular.z = angular;
  limited_topic_->publish(limited_, now);
}

void DiffDriveController::update(Time now, Duration period) {
  if (!chained_) take_references(now);
  const double wanted_linear = reference_handles[0].get(), wanted_angular = reference_handles[1].get();
  if (!std::isfinite(wanted_linear) || !std::isfinite(wanted_angular)) return;  // no command yet
  const double dt = to_seconds(period);
  const double linear = linear_limiter_.limit(wanted_linear, dt);
  const double angular = angular_limiter_.limit(wanted_angular, dt);
  if (settings_.open_loop) {
    odometry_.move_exactly({linear, 0, angular}, dt);
  } else if (!measure(dt)) {
    // ros2_control deactivates the controller, which stops the wheels.
    invalid_state_ = true;
    drive(0, 0);
    return;
  }
  publisher_.publish(now, odometry_);
  publish_limited(now, linear, angular);
  drive(linear, angular);
}

void DiffDriveController::housekeeping(Time now) {
  if (!chained_) command_.report_braking(now);
  if (!invalid_state_ || invalid_state_reported_) return;
  invalid_state_reported_ = true;
  context_->log->error(context_->name,
                       "a wheel's state is not a number: the wheels stop, and the odometry is not updated");
}

}  // namespace doppel
