#pragma once
// The last velocity command of a base: geometry_msgs/msg/TwistStamped with its age, as ros2_controllers' bases
// take it. A stamp of zero is now; a command that is already older than the time-out is refused.

#include <cstdint>
#include <string>

#include "doppel/control/manager/controller.h"
#include "doppel/ros/messages/geometry_msgs.h"

namespace doppel {

class TwistCommand {
 public:
  // `timeout`: the value of the parameter `parameter`; zero: commands are valid forever.
  void configure(const ControllerContext& context, const char* parameter, Duration timeout);
  // No command; its age counts from `now`.
  void forget(Time now);
  void receive(const geometry_msgs::msg::TwistStamped& message);
  void receive(const geometry_msgs::msg::Twist& message);  // given now

  // True if it is older than the time-out.
  [[nodiscard]] bool is_stale(Time now) const { return timeout_ > Duration{} && now - run_.stamp > timeout_; }
  // Whether the components that `finite` looks at are numbers is the caller's question: NaN until the first.
  [[nodiscard]] const geometry_msgs::msg::Twist& twist() const { return run_.twist; }
  [[nodiscard]] Duration timeout() const { return timeout_; }

  // The state that changes from command to command.
  struct Run {
    Time stamp{};  // in the loop's time
    geometry_msgs::msg::Twist twist;
    bool zero_stamp_reported = false, old_reported = false, ahead_reported = false, braking_reported = false;
  };
  [[nodiscard]] const Run& run() const { return run_; }
  void set_run(const Run& run) { run_ = run; }

  // Between steps: reports once that the base brakes because commands ended while it was commanded to move.
  void report_braking(Time now);

 private:
  [[nodiscard]] bool moves() const;

  std::string name_, parameter_;
  const Log* log_ = nullptr;
  const Bus* bus_ = nullptr;
  Duration timeout_{};
  Run run_;
};

}  // namespace doppel
