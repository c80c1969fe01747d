#include "doppel/control/controllers/detail/diff_drive_controller.h"

#include <cmath>

#include "doppel/control/controllers/detail/speed_limit_parameters.h"
#include "doppel/control/hardware/hardware.h"

namespace doppel {
namespace {

constexpr const char *kLinear = "linear.x", *kAngular = "angular.z";

}  // namespace

void DiffDriveController::on_init(ControllerContext& context) {
  declare_diff_drive(context);
  declare_speed_limits(context, kLinear);
  declare_speed_limits(context, kAngular);
  const bool stamped = declare_stamped_commands(context);
  declare_velocity_base(context, {}, stamped);
}

Status DiffDriveController::on_configure() {
  const Parameters& parameters = context_->node->parameters();
  settings_ = diff_drive_settings(parameters);
  if (settings_.left.size() != settings_.right.size())
    return Status::refused("left_wheel_names and right_wheel_names differ in number");
  if (Status fine = linear_limiter_.set(speed_limits(parameters, kLinear)); !fine) return fine;
  if (Status fine = angular_limiter_.set(speed_limits(parameters, kAngular)); !fine) return fine;
  if (settings_.publish_limited_velocity && !limited_topic_) {
    limited_topic_ = context_->node->advertise<geometry_msgs::msg::TwistStamped>(
        "~/cmd_vel_out", Qos::system_default_publisher());
  }
  last_left_ = last_right_ = kNaN;
  return configure_velocity_base(
      {.timeout = settings_.timeout, .window = settings_.window, .open_loop = settings_.open_loop});
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

void DiffDriveController::rest() {
  linear_limiter_.reset();
  angular_limiter_.reset();
}

void DiffDriveController::write_references(const geometry_msgs::msg::Twist& twist) {
  const double linear = twist.linear.x, angular = twist.angular.z;
  if (!std::isfinite(linear) || !std::isfinite(angular)) return;
  reference_handles[0].set(linear);
  reference_handles[1].set(angular);
}

PlanarVelocity DiffDriveController::next_velocity(double dt) {
  return {linear_limiter_.limit(reference_handles[0].get(), dt), 0,
          angular_limiter_.limit(reference_handles[1].get(), dt)};
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

void DiffDriveController::drive(const PlanarVelocity& velocity) {
  const double aside = velocity.yaw * settings_.separation / 2;
  const double left = (velocity.x - aside) / settings_.left_radius,
               right = (velocity.x + aside) / settings_.right_radius;
  const std::size_t wheels = settings_.left.size();
  for (std::size_t i = 0; i < wheels; ++i) {
    command_handles[i].set(left);
    command_handles[wheels + i].set(right);
  }
}

void DiffDriveController::publish_limited(Time now, const PlanarVelocity& velocity) {
  if (!limited_topic_ || !settings_.publish_limited_velocity || !limited_topic_->has_listeners()) return;
  limited_.header.stamp = to_time_msg(context_->node->bus().stamp(now));
  limited_.twist.linear.x = velocity.x;
  limited_.twist.angular.z = velocity.yaw;
  limited_topic_->publish(limited_, now);
}

}  // namespace doppel
