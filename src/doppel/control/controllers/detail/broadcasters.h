#pragma once
// Broadcasters of state interfaces: of one sensor as one message (IMU, force-torque, range, satellite and
// magnetic sensors, poses), of lists as numbers, and of batteries. Parameters, defaults, topics and QoS as in
// ros2_controllers (its jazzy branch, 4.x).

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "doppel/control/controllers/detail/controller_parameters.h"
#include "doppel/control/manager/controller.h"
#include "doppel/ros/messages/builtin_interfaces.h"

namespace doppel {

// Reads the named state interfaces, in order, and commands nothing.
class SensorBroadcaster : public Controller {
 public:
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override { return {}; }
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override {
    return {InterfaceConfiguration::Kind::individual, interfaces_};
  }
  void update(Time now, Duration /*period*/) override { publish_state(now); }
  // Its messages are functions of the states alone.
  [[nodiscard]] bool save(SavedSlot& /*slot*/) const override { return true; }

 protected:
  // "<prefix>/<name>" for each of the names.
  void read(const std::string& prefix, const std::vector<std::string>& names) {
    for (const std::string& name : names) interfaces_.push_back(prefix + "/" + name);
  }
  [[nodiscard]] double value(std::size_t i) const { return state_handles[i].get(); }

  std::vector<std::string> interfaces_;
};

// Publishes one message with a stamp in each update.
template <Message M>
class MessageBroadcaster : public SensorBroadcaster {
 public:
  void publish_state(Time now) override {
    if (!topic_.has_listeners()) return;
    fill();
    message_.header.stamp = to_time_msg(bus_->stamp(now));
    topic_.publish(message_, now);
  }

 protected:
  void advertise(ControllerContext& context, const char* topic) {
    bus_ = &context.node->bus();
    topic_ = context.node->advertise<M>(topic, Qos::system_default_publisher());
  }
  virtual void fill() = 0;  // the values of the message

  Bus* bus_ = nullptr;
  M message_;
  Publisher<M> topic_;
};

// A text that has to be written. example: "imu".
ControllerParameter required_text(const char* name, std::string& text, const char* description,
                                  const char* example);
// Prefix and frame of a sensor: sensor_name, frame_id.
ControllerParameter sensor_parameter(std::string& sensor, const char* example);
ControllerParameter frame_parameter(std::string& frame, const char* example);

std::unique_ptr<Controller> make_joint_state_broadcaster();
std::unique_ptr<Controller> make_imu_broadcaster();
std::unique_ptr<Controller> make_force_torque_broadcaster();
std::unique_ptr<Controller> make_range_broadcaster();
std::unique_ptr<Controller> make_satellite_broadcaster();
std::unique_ptr<Controller> make_magnetometer_broadcaster();
std::unique_ptr<Controller> make_pose_broadcaster();
std::unique_ptr<Controller> make_battery_state_broadcaster();
std::unique_ptr<Controller> make_state_interfaces_broadcaster();

}  // namespace doppel
