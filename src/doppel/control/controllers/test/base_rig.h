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

struct ReferenceRig : ManagerRig {
  using Names = std::vector<std::string>;
  // `velocities` and `positions`: joints by their command interface; all states of each.
  ReferenceRig(const std::string& type, const std::string& parameters, const Names& velocities,
               const Names& positions = {})
      : ManagerRig("controller_manager: {ros__parameters: {update_rate: 100, base: {type: " + type +
                       "}}}\nbase: {ros__parameters: {" + parameters + "}}\n",
                   joints_of(velocities, positions), hardware_of(velocities, positions)),
        node(bus, "/speaker") {
    references = node.advertise<geometry_msgs::msg::TwistStamped>("/base/reference");
  }
  void listen() {
    node.subscribe<nav_msgs::msg::Odometry>("/base/odometry",
                                            [this](const auto& m) { odometry.push_back(m); });
    node.subscribe<tf2_msgs::msg::TFMessage>("/base/tf_odometry",
                                             [this](const auto& m) { transforms.push_back(m); });
  }
  void start() {
    bus.set_now(now);
    manager->start(Names{"base"});
  }
  void say(double x, double y, double yaw) {
    geometry_msgs::msg::TwistStamped message;
    message.header.stamp = to_time_msg(now);
    message.twist.linear = {x, y, 0};
    message.twist.angular.z = yaw;
    bus.set_now(now);
    references.publish(message, now);
    bus.spin();
  }
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

  Node node;
  Publisher<geometry_msgs::msg::TwistStamped> references;
  std::vector<nav_msgs::msg::Odometry> odometry;
  std::vector<tf2_msgs::msg::TFMessage> transforms;

 private:
  static std::vector<FakeJoint> joints_of(const Names& velocities, const Names& positions) {
    std::vector<FakeJoint> out;
    for (const std::string& name : velocities) out.push_back({name, JointType::continuous});
    for (const std::string& name : positions) out.push_back({name, JointType::continuous});
    return out;
  }
  static FakeHardwareOptions hardware_of(const Names& velocities, const Names& positions) {
    FakeHardwareOptions options;
    options.joints = velocities;
    options.joints.insert(options.joints.end(), positions.begin(), positions.end());
    options.commands = positions.empty() ? Names{kVelocity} : Names{kVelocity, kPosition};
    return options;
  }
};

}  // namespace doppel
