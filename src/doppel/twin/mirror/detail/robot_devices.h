#pragma once
// The devices of one robot, as their components report them.

#include <string>
#include <string_view>

#include "doppel/control/hardware/hardware.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/twin/loop/twin_robot.h"
#include "doppel/twin/mirror/detail/device_services.h"

namespace doppel {

class RobotDevices {
 public:
  // All outlive the devices; see DeviceServices.
  RobotDevices(Bus& bus, TwinRobot& robot, std::vector<std::string>& resting, bool guided);

  // Between steps, with the gate.
  void collect(const TwinRobot& robot);
  void publish(Time now);
  // The joint as its device reported it last; nullptr: it has none.
  [[nodiscard]] const doppel_msgs::msg::DeviceJoint* find(std::string_view joint) const;

 private:
  Node node_;
  DeviceServices services_;
  Publisher<doppel_msgs::msg::Devices> topic_;
  doppel_msgs::msg::Devices message_;
  DeviceReport report_;
};

// Between steps, with the gate.
[[nodiscard]] bool has_devices(const TwinRobot& robot);

}  // namespace doppel
