#include "doppel/control/controllers/detail/velocity_base.h"

#include <algorithm>
#include <cmath>

#include "doppel/control/hardware/nan.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {

void VelocityBase::declare_velocity_base(ControllerContext& context,
                                         const OdometryPublisher::Options& odometry, bool stamped) {
  context_ = &context;
  publisher_.declare(context, odometry);
  Node& node = *context.node;
  const auto receive = [this](const auto& message) {
    if (active_ && !chained_) command_.receive(message);
  };
  const Qos qos = Qos::system_default_subscription();
  if (stamped) {
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

Status VelocityBase::configure_velocity_base(const Configuration& configuration) {
  if (Status fine = publisher_.configure(); !fine) return fine;
  command_.configure(*context_, "cmd_vel_timeout", configuration.timeout);
  open_loop_ = configuration.open_loop;
  odometry_.set_window(configuration.window);
  odometry_.reset();
  return {};
}

// No reference, no history of the limiters and no command: what was commanded before does not come back.
void VelocityBase::forget() {
  for (CommandHandle& reference : reference_handles) reference.set(kNaN);
  rest();
  command_.forget(context_->node->bus().now());
}

Status VelocityBase::on_activate() {
  forget();
  active_ = true;
  chained_ = invalid_state_ = invalid_state_reported_ = false;
  return {};
}

Status VelocityBase::on_deactivate() {
  active_ = false;
  for (CommandHandle& wheel : command_handles) wheel.set(0.0);
  forget();
  return {};
}

// The base brakes: neither a former leader's references nor a former command are continued.
void VelocityBase::set_chained_mode(bool chained) {
  chained_ = chained;
  command_.forget(context_->node->bus().now());
  for (CommandHandle& reference : reference_handles) {
    if (std::isfinite(reference.get())) reference.set(0.0);
  }
}

void VelocityBase::take_references(Time now) {
  if (command_.is_stale(now)) {
    for (CommandHandle& reference : reference_handles) reference.set(0.0);
  } else {
    write_references(command_.twist());
  }
}

void VelocityBase::update(Time now, Duration period) {
  if (!chained_) take_references(now);
  const auto is_number = [](const CommandHandle& reference) { return std::isfinite(reference.get()); };
  if (!std::ranges::all_of(reference_handles, is_number)) return;  // no command yet
  const double dt = to_seconds(period);
  const PlanarVelocity velocity = next_velocity(dt);
  if (open_loop_) {
    odometry_.move_exactly(velocity, dt);
  } else if (!measure(dt)) {
    // ros2_control deactivates the controller, which stops the wheels.
    invalid_state_ = true;
    drive({});
    return;
  }
  publisher_.publish(now, odometry_);
  publish_limited(now, velocity);
  drive(velocity);
}

void VelocityBase::housekeeping(Time now) {
  if (!chained_) command_.report_braking(now);
  if (!invalid_state_ || invalid_state_reported_) return;
  invalid_state_reported_ = true;
  context_->log->error(context_->name,
                       "a wheel's state is not a number: the wheels stop, and the odometry is not updated");
}

}  // namespace doppel
