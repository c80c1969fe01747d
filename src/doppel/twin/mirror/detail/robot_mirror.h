#pragma once
// Real hardware of one robot beside its twin: an error for each joint, and alarms.

#include <cstdint>
#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/control/residuals/joint_residual.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/scenario/schema/scenario.h"
#include "doppel/twin/loop/twin_robot.h"
#include "doppel/twin/mirror/detail/robot_devices.h"

namespace doppel {

class RobotMirror {
 public:
  RobotMirror(Bus& bus, const TwinRobot& robot, MirrorMode mode);

  // In the loop, with the gate: no allocation, no throw.
  void after_step(const TwinRobot& robot, Time now);
  void restart();
  // Between steps, with the gate, after the devices were collected.
  void look(const TwinRobot& robot, const RobotDevices& devices, Time now, const Log& log);
  void publish(const TwinRobot& robot, Time now);

 private:
  struct Joint {
    std::string name, position, velocity;  // the last two: its interfaces
    int joint = -1;
    std::size_t q = 0;
    double effort = 0;  // limit of the twin's drive, N m or N
    JointResidual residual;
    bool measured = false, shadowed = false;
    double measured_q = 0, twin_q = 0, model_load = 0;
    // The last report of its device.
    double goal = 0, load = 0;
    bool believed = false, held_back = false, released = false;
    std::uint64_t logged = 0;  // alarms
    Time alarm_since{};
  };
  [[nodiscard]] bool is_held_back(const TwinRobot& robot, const Joint& joint) const;
  void log_alarm(Joint& joint, Time now, const Log& log) const;
  [[nodiscard]] std::string alarm_text(const Joint& joint) const;
  [[nodiscard]] std::string note(const Joint& joint) const;

  const MirrorMode mode_;
  Node node_;
  Publisher<doppel_msgs::msg::Mirror> topic_;
  doppel_msgs::msg::Mirror message_;
  std::vector<Joint> joints_;
  Time next_sample_{};
};

}  // namespace doppel
