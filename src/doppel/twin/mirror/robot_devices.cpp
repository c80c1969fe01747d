#include "doppel/twin/mirror/detail/robot_devices.h"

#include "doppel/scenario/schema/robot_names.h"

namespace doppel {
namespace {

void write(const DeviceReport::Joint& joint, const Bus& bus, doppel_msgs::msg::DeviceJoint& message) {
  const auto stamp = [&](Time when) { return to_time_msg(when == Time{} ? when : bus.stamp(when)); };
  message.name = joint.name;
  message.id = joint.id;
  message.position = joint.position;
  message.goal = joint.goal;
  message.velocity = joint.velocity;
  message.load = joint.load;
  message.current = joint.current;
  message.voltage = joint.voltage;
  message.temperature = joint.temperature;
  message.age = joint.age;
  message.believed = joint.believed;
  message.faults = joint.faults;
  message.released = joint.released;
  message.torque_off = stamp(joint.torque_off);
  message.torque_on = stamp(joint.torque_on);
}

}  // namespace

RobotDevices::RobotDevices(Bus& bus, TwinRobot& robot, std::vector<std::string>& resting, bool guided)
    : node_(bus, in_namespace(robot.name_space(), "doppel")),
      services_(node_, robot, resting, guided),
      topic_(node_.advertise<doppel_msgs::msg::Devices>("~/hardware")) {}

bool has_devices(const TwinRobot& robot) {
  const ControllerManager& manager = robot.controller_manager();
  DeviceReport report;
  const std::size_t count = manager.hardware().size();
  for (std::size_t i = 0; i < count; ++i) {
    if (manager.report(i, report)) return true;
  }
  return false;
}

void RobotDevices::collect(const TwinRobot& robot) {
  const ControllerManager& manager = robot.controller_manager();
  std::size_t count = 0;
  const std::vector<HardwareView> components = manager.hardware();
  for (std::size_t i = 0; i < components.size(); ++i) {
    if (!manager.report(i, report_)) continue;
    if (message_.devices.size() == count) message_.devices.emplace_back();
    doppel_msgs::msg::Device& device = message_.devices[count++];
    device.name = components[i].name;
    device.plugin = components[i].plugin;
    device.component_state = to_string(components[i].state);
    device.state = report_.state;
    device.port = report_.port;
    device.fault = components[i].fault;
    device.cycles = report_.cycles;
    device.lost = report_.lost;
    device.damaged = report_.damaged;
    device.joints.resize(report_.joints.size());
    for (std::size_t j = 0; j < device.joints.size(); ++j)
      write(report_.joints[j], node_.bus(), device.joints[j]);
  }
  message_.devices.resize(count);
}

void RobotDevices::publish(Time now) {
  if (!topic_.has_listeners()) return;
  message_.header.stamp = to_time_msg(node_.bus().stamp(now));
  topic_.publish(message_, now);
}

const doppel_msgs::msg::DeviceJoint* RobotDevices::find(std::string_view joint) const {
  for (const doppel_msgs::msg::Device& device : message_.devices) {
    for (const doppel_msgs::msg::DeviceJoint& one : device.joints) {
      if (one.name == joint) return &one;
    }
  }
  return nullptr;
}

}  // namespace doppel
