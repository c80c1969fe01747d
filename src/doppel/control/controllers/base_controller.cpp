#include "doppel/control/controllers/detail/base_controller.h"

#include <algorithm>
#include <cmath>

#include "doppel/control/hardware/hardware.h"
#include "doppel/control/manager/joint_list.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {
namespace {

constexpr std::array<const char*, 3> kComponents{"linear.x", "linear.y", "angular.z"};
constexpr PlanarVelocity kNoReference{kNaN, kNaN, kNaN};

bool is_number(const PlanarVelocity& velocity) {
  return std::isfinite(velocity.x) && std::isfinite(velocity.y) && std::isfinite(velocity.yaw);
}

}  // namespace

void refuse_base_parameter(const ControllerContext& context, const std::string& parameter,
                           const std::string& why, const std::string& fix) {
  refuse_parameter(context, "control.base_parameter", parameter, why, fix);
}

void check_driven_joints(const ControllerContext& context, const std::string& parameter,
                         const std::vector<std::string>& joints) {
  if (check_joints(context, parameter, joints) != joints)
    refuse_base_parameter(context, parameter, "lists a joint that mimics another and has no drive",
                          "list driven joints only");
}

bool BaseController::is_limited(std::size_t component) const {
  return type_.limits != BaseType::Limits::none && (type_.sideways || component != 1);
}

void BaseController::on_init(ControllerContext& context) {
  context_ = &context;
  declare_parameters(context, parameters());
  const bool deprecated = type_.limits == BaseType::Limits::with_deprecated;
  for (std::size_t i = 0; i < limits_.size(); ++i) {
    if (!is_limited(i)) continue;
    declare_parameters(context, limits_[i].list(kComponents[i], deprecated));
    if (deprecated) report_deprecated_limits(context, limits_[i], kComponents[i]);
  }
  publisher_.declare(context, type_.odometry);
  Node& node = *context.node;
  const auto receive = [this](const auto& message) {
    if (active_ && !chained_) command_.receive(message);
  };
  const Qos qos = Qos::system_default_subscription();
  if (type_.topic.ends_with("_unstamped")) {
    node.subscribe<geometry_msgs::msg::Twist>(type_.topic, receive, qos);
  } else {
    node.subscribe<geometry_msgs::msg::TwistStamped>(type_.topic, receive, qos);
  }
  if (type_.no_command != NoCommand::wait) return;
  node.serve<control_msgs::srv::SetOdometry>("~/set_odometry", [this](const auto& request, auto respond) {
    if (!active_) return respond({false, "the controller is not active"});
    odometry_.reset({request.x, request.y, request.yaw});
    respond({true, "the odometry is set"});
  });
}

Status BaseController::on_configure() {
  const Parameters& present = context_->node->parameters();
  read_parameters(present, parameters());
  for (std::size_t i = 0; i < limits_.size(); ++i) {
    if (!is_limited(i)) continue;
    read_parameters(present,
                    limits_[i].list(kComponents[i], type_.limits == BaseType::Limits::with_deprecated));
    if (Status fine = limiters_[i].set(limits_[i].present()); !fine) return fine;
  }
  if (Status fine = publisher_.configure(); !fine) return fine;
  if (Status fine = arrange(); !fine) return fine;
  const Duration timeout = std::max(from_seconds(timeout_), type_.shortest_timeout);
  uses_once_ = type_.no_command == NoCommand::stop && timeout == Duration{};
  command_.configure(*context_, type_.timeout_parameter, timeout);
  odometry_.set_window(static_cast<std::size_t>(window_));
  odometry_.reset();
  return {};
}

InterfaceConfiguration BaseController::command_interfaces() const {
  InterfaceConfiguration claimed{InterfaceConfiguration::Kind::individual, {}};
  for (const DrivenWheel& wheel : wheels_) claimed.names.push_back(wheel.joint + "/" + kVelocity);
  for (const std::string& joint : steered_) claimed.names.push_back(joint + "/" + kPosition);
  return claimed;
}

InterfaceConfiguration BaseController::state_interfaces() const {
  // Without feedback only the angle of the steering is needed.
  if (open_loop_ && steered_.empty()) return {};
  InterfaceConfiguration states{InterfaceConfiguration::Kind::individual, {}};
  const std::string feedback = position_feedback_ ? kPosition : kVelocity;
  for (const DrivenWheel& wheel : wheels_) states.names.push_back(wheel.measured + "/" + feedback);
  for (const std::string& joint : steered_measured_) states.names.push_back(joint + "/" + kPosition);
  return states;
}

std::vector<std::string> BaseController::reference_interfaces() const {
  if (!type_.has_references) return {};
  if (type_.sideways) return {"linear/x/velocity", "linear/y/velocity", "angular/z/velocity"};
  return {"linear/velocity", "angular/velocity"};
}

void BaseController::read_reference() {
  reference_ = {reference_handles.front().get(), type_.sideways ? reference_handles[1].get() : 0,
                reference_handles.back().get()};
}

void BaseController::set_reference(const PlanarVelocity& reference) {
  reference_ = reference;
  if (!type_.has_references) return;
  reference_handles.front().set(reference.x);
  if (type_.sideways) reference_handles[1].set(reference.y);
  reference_handles.back().set(reference.yaw);
}

// No reference, no history of the limits and no command: what was commanded before does not come back.
void BaseController::forget() {
  command_.forget(context_->node->bus().now());
  set_reference(kNoReference);
  rest();
}

Status BaseController::on_activate() {
  forget();
  active_ = true;
  chained_ = invalid_state_ = invalid_state_reported_ = false;
  return {};
}

Status BaseController::on_deactivate() {
  active_ = false;
  stop();
  forget();
  return {};
}

// Neither a former leader's references nor a former command are continued: the base brakes or stops.
void BaseController::set_chained_mode(bool chained) {
  chained_ = chained;
  command_.forget(context_->node->bus().now());
  read_reference();
  const bool brakes = type_.no_command == NoCommand::wait && is_number(reference_);
  set_reference(brakes ? PlanarVelocity{} : kNoReference);
}

// In a chain a leader has written the references earlier in this tick.
void BaseController::take_reference(Time now) {
  if (chained_) return read_reference();
  const geometry_msgs::msg::Twist& twist = command_.twist();
  const PlanarVelocity commanded{twist.linear.x, type_.sideways ? twist.linear.y : 0, twist.angular.z};
  const bool stale = command_.is_stale(now);
  if (!stale && is_number(commanded)) {
    set_reference(commanded);
  } else if (type_.no_command == NoCommand::stop) {
    set_reference(kNoReference);
  } else if (stale || type_.no_command == NoCommand::brake) {
    set_reference({});
  }
  if (uses_once_) command_.forget(now);
}

void BaseController::update(Time now, Duration period) {
  take_reference(now);
  const bool commanded = is_number(reference_);
  if (!commanded && type_.no_command == NoCommand::wait) return;  // no command yet
  const double dt = to_seconds(period);
  PlanarVelocity velocity;
  if (commanded) {
    velocity = {limiters_[0].limit(reference_.x, dt), limiters_[1].limit(reference_.y, dt),
                limiters_[2].limit(reference_.yaw, dt)};
  }
  const std::optional<PlanarVelocity> measured = state_handles.empty() ? velocity : measure(dt);
  if (!measured && type_.no_command != NoCommand::stop) {
    // ros2_control deactivates the controller, which stops the wheels.
    invalid_state_ = true;
    return stop();
  }
  if (open_loop_) {
    odometry_.move_exactly(velocity, dt);
  } else if (measured) {
    odometry_.move(*measured, dt);
  }
  if (commanded) {
    drive(velocity, dt);
  } else {
    stop();
    rest();  // the next reference begins from rest
  }
  publisher_.publish(now, odometry_);
  report(now, velocity);
  if (chained_ && type_.no_command == NoCommand::stop) set_reference(kNoReference);
}

double BaseController::wheel_speed(std::size_t wheel, double dt) {
  const double state = state_handles[wheel].get();
  if (!position_feedback_) return state;
  double& last = wheels_[wheel].last;
  const double speed = std::isnan(last) ? 0.0 : (state - last) / dt;
  last = state;
  return speed;
}

// The least squares of all wheels, where the columns of their kinematics are orthogonal: wheels in pairs on
// both sides, or evenly spaced on a circle.
std::optional<PlanarVelocity> BaseController::measure(double dt) {
  const auto is_finite = [](const StateHandle& state) { return std::isfinite(state.get()); };
  if (!std::ranges::all_of(state_handles, is_finite)) return std::nullopt;
  PlanarVelocity sum, squares;
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const DrivenWheel& wheel = wheels_[i];
    const double rim = wheel_speed(i, dt) * wheel.radius;
    sum = {sum.x + wheel.ahead * rim, sum.y + wheel.aside * rim, sum.yaw + wheel.turn * rim};
    squares.x += wheel.ahead * wheel.ahead;
    squares.y += wheel.aside * wheel.aside;
    squares.yaw += wheel.turn * wheel.turn;
  }
  return PlanarVelocity{sum.x / squares.x, type_.sideways ? sum.y / squares.y : 0, sum.yaw / squares.yaw};
}

void BaseController::drive(const PlanarVelocity& velocity, double /*dt*/) {
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const DrivenWheel& wheel = wheels_[i];
    command_handles[i].set((wheel.ahead * velocity.x + wheel.aside * velocity.y + wheel.turn * velocity.yaw) /
                           wheel.radius);
  }
}

void BaseController::stop() {
  for (CommandHandle& command : command_handles) command.set(0.0);
}

void BaseController::rest() {
  for (SpeedLimiter& limiter : limiters_) limiter.reset();
}

void BaseController::save_base(SavedBase& out) const {
  out.reference = reference_;
  for (std::size_t i = 0; i < limiters_.size(); ++i) out.limiters[i] = limiters_[i].past();
  out.command = command_.run();
  out.wheels.clear();
  for (const DrivenWheel& wheel : wheels_) out.wheels.push_back(wheel.last);
  out.odometry = odometry_;
  out.published = publisher_.last();
  out.invalid_state = invalid_state_;
  out.invalid_state_reported = invalid_state_reported_;
}

void BaseController::restore_base(const SavedBase& saved) {
  reference_ = saved.reference;
  for (std::size_t i = 0; i < limiters_.size(); ++i) limiters_[i].set_past(saved.limiters[i]);
  command_.set_run(saved.command);
  for (std::size_t i = 0; i < std::min(wheels_.size(), saved.wheels.size()); ++i)
    wheels_[i].last = saved.wheels[i];
  odometry_ = saved.odometry;
  publisher_.set_last(saved.published);
  invalid_state_ = saved.invalid_state;
  invalid_state_reported_ = saved.invalid_state_reported;
}

void BaseController::housekeeping(Time now) {
  if (!chained_) command_.report_braking(now);
  if (!invalid_state_ || invalid_state_reported_) return;
  invalid_state_reported_ = true;
  context_->log->error(context_->name,
                       "a wheel's state is not a number: the wheels stop, and the odometry is not updated");
}

}  // namespace doppel
