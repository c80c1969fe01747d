#pragma once
// A controller of a base named "base" under the controller manager, with its messages.

#include <optional>
#include <string>
#include <vector>

#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/nav_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"

namespace doppel {

// `velocities` and `positions`: joints by their command interface; all states of each.
inline FakeHardwareOptions base_hardware(const std::vector<std::string>& velocities,
                                         const std::vector<std::string>& positions = {}) {
  FakeHardwareOptions options;
  options.joints = velocities;
  options.joints.insert(options.joints.end(), positions.begin(), positions.end());
  options.commands = {kVelocity};
  if (!positions.empty()) options.commands.emplace_back(kPosition);
  return options;
}

inline std::vector<FakeJoint> continuous_joints(const std::vector<std::string>& names) {
  std::vector<FakeJoint> out;
  for (const std::string& name : names) out.push_back({name, JointType::continuous});
  return out;
}

struct BaseRig : ManagerRig {
  BaseRig(const std::string& type, const std::string& parameters, const FakeHardwareOptions& options)
      : ManagerRig(controller_yaml("base", type, parameters), continuous_joints(options.joints), options),
        has_references(type.find("mecanum") != std::string::npos ||
                       type.find("_steering") != std::string::npos),
        commands(node.advertise<geometry_msgs::msg::TwistStamped>(has_references ? "/base/reference"
                                                                                 : "/base/cmd_vel")) {}
  void start() {
    node.subscribe<nav_msgs::msg::Odometry>(has_references ? "/base/odometry" : "/base/odom",
                                            [this](const auto& m) { odometry.push_back(m); });
    node.subscribe<tf2_msgs::msg::TFMessage>(has_references ? "/base/tf_odometry" : "/tf",
                                             [this](const auto& m) { transforms.push_back(m); });
    ManagerRig::start({"base"});
  }
  void say(double x, double y, double yaw, std::optional<Time> stamp = std::nullopt) {
    geometry_msgs::msg::TwistStamped message;
    message.header.stamp = to_time_msg(stamp.value_or(now));
    message.twist.linear = {x, y, 0};
    message.twist.angular.z = yaw;
    bus.set_now(now);
    commands.publish(message, now);
    bus.spin();
  }
  // Repeats the command so that it does not time out.
  void drive(double x, double y, double yaw, double seconds) {
    const Time end = now + from_seconds(seconds);
    while (now < end) {
      say(x, y, yaw);
      run(1);
    }
  }
  [[nodiscard]] double velocity(const std::string& joint) const {
    return hardware->last_command(joint + "/velocity");
  }
  [[nodiscard]] double position(const std::string& joint) const {
    return hardware->last_command(joint + "/position");
  }

  bool has_references = false;  // of mecanum_drive_controller and steering_controllers_library
  Node node{bus, "/client"};
  Publisher<geometry_msgs::msg::TwistStamped> commands;
  std::vector<nav_msgs::msg::Odometry> odometry;
  std::vector<tf2_msgs::msg::TFMessage> transforms;
};

}  // namespace doppel
