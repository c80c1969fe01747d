#include "doppel/control/controllers/detail/twist_command.h"

#include <fmt/format.h>

#include <cmath>

#include "doppel/control/hardware/nan.h"

namespace doppel {

void TwistCommand::configure(const ControllerContext& context, const char* parameter, Duration timeout) {
  name_ = context.name;
  parameter_ = parameter;
  log_ = context.log;
  bus_ = &context.node->bus();
  timeout_ = timeout;
  forget(bus_->now());
}

void TwistCommand::forget(Time now) {
  run_.stamp = now;
  run_.twist = {{kNaN, kNaN, kNaN}, {kNaN, kNaN, kNaN}};
  run_.old_reported = run_.braking_reported = false;
}

void TwistCommand::receive(const geometry_msgs::msg::TwistStamped& message) {
  const Time now = bus_->now();
  const auto& written = message.header.stamp;
  const bool unstamped = written.sec == 0 && written.nanosec == 0;
  if (unstamped && !run_.zero_stamp_reported) {
    run_.zero_stamp_reported = true;
    log_->note(name_,
               "a command has the stamp 0, which is taken as now, as in ros2_controllers; set header.stamp "
               "so that late commands are recognised");
  }
  const Time stamp = unstamped ? now : bus_->from_stamp(from_msg(written));
  if (timeout_ > Duration{} && now - stamp >= timeout_) {
    if (!run_.old_reported) {
      log_->warning(name_, fmt::format("commands are refused: a stamp is {:.3f} s old, and {} is {:g} s; "
                                       "stamp them with the time of /clock when they are sent",
                                       to_seconds(now - stamp), parameter_, to_seconds(timeout_)));
    }
    run_.old_reported = true;
    return;
  }
  if (timeout_ > Duration{} && stamp - now > timeout_ && !run_.ahead_reported) {
    run_.ahead_reported = true;
    log_->warning(
        name_,
        fmt::format(
            "a command's stamp is {:.3f} s ahead, so that the command does not end after {} of {:g} s, as "
            "in ros2_controllers; stamp commands with the time of /clock (use_sim_time:=true)",
            to_seconds(stamp - now), parameter_, to_seconds(timeout_)));
  }
  run_.old_reported = run_.braking_reported = false;
  run_.stamp = stamp;
  run_.twist = message.twist;
}

void TwistCommand::receive(const geometry_msgs::msg::Twist& message) {
  run_.braking_reported = false;
  run_.stamp = bus_->now();
  run_.twist = message;
}

bool TwistCommand::moves() const {
  const auto nonzero = [](const geometry_msgs::msg::Vector3& v) {
    return std::abs(v.x) + std::abs(v.y) + std::abs(v.z) > 0;  // false for NaN
  };
  return nonzero(run_.twist.linear) || nonzero(run_.twist.angular);
}

void TwistCommand::report_braking(Time now) {
  if (run_.braking_reported || !is_stale(now) || !moves()) return;
  run_.braking_reported = true;
  log_->warning(name_, fmt::format("no command for {:g} s ({}): the base brakes; a command holds only as "
                                   "long as it is repeated",
                                   to_seconds(timeout_), parameter_));
}

}  // namespace doppel
