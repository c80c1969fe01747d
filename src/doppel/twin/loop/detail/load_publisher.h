#pragma once
// /doppel/joint_loads (doppel_msgs/msg/JointLoads, 5 Hz of simulated time, only while there are subscribers):
// the load of each driven joint, and its sag under gravity. In the robot's namespace.

#include <memory>
#include <optional>

#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/scenario/compile/compiled_robot.h"
#include "doppel/twin/loop/publish_schedule.h"

namespace doppel {

class LoadPublisher {
 public:
  LoadPublisher(Bus& bus, std::shared_ptr<const CompiledRobot> machine);

  // Between steps. `robot`: the machine's instance.
  void publish_due(const Instance& robot, Time now) {
    if (due_(now, topic_.has_listeners())) publish(robot, now);
  }
  void at_once() { due_.at_once(); }

 private:
  void publish(const Instance& robot, Time now);

  const std::shared_ptr<const CompiledRobot> machine_;
  Node node_;
  Publisher<doppel_msgs::msg::JointLoads> topic_;
  PublishSchedule due_{Duration{200'000'000}};
  std::optional<Data> data_;  // made for the first subscriber
  StaticSag static_;
  doppel_msgs::msg::JointLoads message_;
};

}  // namespace doppel
