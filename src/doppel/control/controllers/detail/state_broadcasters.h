#pragma once
// Broadcasters of lists of state interfaces: as numbers, and of batteries. Parameters, defaults, topics and QoS as in
// ros2_controllers (its jazzy branch, 4.x).

#include <optional>
#include <string>
#include <vector>

#include "doppel/control/controllers/detail/sensor_broadcasters.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {

// The names are published once, latched, the values in each update.
class StateInterfacesBroadcaster : public SensorBroadcaster {
 public:
  void on_init(ControllerContext& context) override;
  Status on_configure() override;
  void publish_state(Time now) override;

 private:
  control_msgs::msg::Keys names_;
  control_msgs::msg::Float64Values message_;
  Publisher<control_msgs::msg::Keys> names_topic_;
  Publisher<control_msgs::msg::Float64Values> topic_;
};

// ~/battery_state is the mean or sum over all batteries, ~/raw_battery_states has each of them. As there, percentages are
// from 0 to 100.
class BatteryStateBroadcaster : public SensorBroadcaster {
 public:
  void on_init(ControllerContext& context) override;
  void publish_state(Time now) override;

 private:
  // The state interfaces of a battery beside its voltage, in their order.
  enum Part { temperature, current, charge, percentage, status, health, present, kParts };
  struct Battery {
    std::array<std::optional<std::size_t>, kParts> handles;  // nullopt: it is not read
    std::size_t voltage = 0;
    float lowest = 0, highest = 0;  // V, at 0 and 100 %; NaN: not written
  };
  void declare_battery(ControllerContext& context, const std::string& name);
  void combine_texts();
  void read_battery(const Battery& battery, sensor_msgs::msg::BatteryState& out) const;
  void combine();

  std::vector<Battery> batteries_;
  bool single_ = false;  // of the deprecated parameter sensor_name
  control_msgs::msg::BatteryStateArray each_;
  sensor_msgs::msg::BatteryState message_;
  Publisher<control_msgs::msg::BatteryStateArray> each_topic_;
  Publisher<sensor_msgs::msg::BatteryState> topic_;
};

}  // namespace doppel
