#pragma once
// /doppel/joint_loads (doppel_msgs/msg/JointLoads, 5 Hz of simulated time, only while somebody listens): what
// each driven joint bears, and how far gravity pulls it off its target.

#include <optional>

#include "doppel/bus/bus.h"
#include "doppel/messages/doppel_msgs.h"
#include "doppel/physics/engine.h"
#include "doppel/twin/due.h"

namespace doppel {

class LoadPublisher {
 public:
  // Model and servos [joints] outlive it. gravity_R: in the root link's axes, m/s^2.
  LoadPublisher(Bus& bus, const Model& model, const std::vector<ServoParameters>& servos,
                const Eigen::Vector3d& gravity_R);

  // Between steps.
  void publish_due(const Engine& engine, Time now) {
    if (due_(now, topic_.has_listeners())) publish(engine, now);
  }
  void at_once() { due_.at_once(); }

 private:
  void publish(const Engine& engine, Time now);

  const Model& model_;
  const std::vector<ServoParameters>& servos_;
  const Eigen::Vector3d gravity_R_;
  Node node_;
  Publisher<doppel_msgs::msg::JointLoads> topic_;
  Due due_{Duration{200'000'000}};
  std::optional<Data> data_;  // made for the first listener
  StaticSag static_;
  doppel_msgs::msg::JointLoads message_;
};

}  // namespace doppel
