#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "doppel/control/controllers/detail/broadcasters.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/joint_list.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {
namespace {

using sensor_msgs::msg::BatteryState;

constexpr const char* kPartNames[] = {"battery_temperature",
                                      "battery_current",
                                      "battery_charge",
                                      "battery_percentage",
                                      "battery_power_supply_status",
                                      "battery_power_supply_health",
                                      "battery_present"};
constexpr auto kNone = std::numeric_limits<float>::quiet_NaN();

ControllerParameter technology_parameter(const std::string& name, std::int64_t& technology) {
  return {name, &technology, "of sensor_msgs/msg/BatteryState; 0: unknown", read_only(value_range(0, 8))};
}

BatteryState unmeasured() {
  BatteryState out;
  out.voltage = out.temperature = out.current = out.charge = out.percentage = kNone;
  out.present = true;
  return out;
}

// Of a number that is none of them: 0, unknown.
std::uint8_t enumerator(double value) {
  return value >= 0 && value <= 255 ? static_cast<std::uint8_t>(value) : std::uint8_t{0};
}

// ~/battery_state is the mean or sum over all batteries, ~/raw_battery_states has each of them. As there,
// percentages are from 0 to 100.
class BatteryStateBroadcaster : public SensorBroadcaster {
 public:
  void on_init(ControllerContext& context) override {
    std::vector<std::string> names;
    std::string sensor;
    double design = kNaN;
    std::int64_t technology = 0;
    declare_parameters(context, {{"batteries", &names, "prefixes of their state interfaces", read_only()},
                                 {"sensor_name", &sensor, "deprecated in Jazzy: one battery's", read_only()},
                                 {"design_capacity", &design, "A h, of sensor_name", read_only()},
                                 technology_parameter("power_supply_technology", technology)});
    if (names.empty() == sensor.empty()) {
      throw InputError(names.empty() ? "control.empty_parameter" : "control.conflicting_parameters",
                       place_of(context, names.empty() ? "batteries" : "sensor_name"),
                       fmt::format("controller '{}' has {} 'batteries' {} 'sensor_name'", context.name,
                                   names.empty() ? "neither" : "both", names.empty() ? "nor" : "and"),
                       "write batteries: [NAME] below its ros__parameters");
    }
    message_ = unmeasured();
    if (!sensor.empty()) {
      single_ = true;
      interfaces_ = {sensor + "/voltage"};
      message_.design_capacity = static_cast<float>(design);
      message_.power_supply_technology = static_cast<std::uint8_t>(technology);
    }
    std::set<std::string> known;
    for (const std::string& name : names) {
      if (!known.insert(name).second)
        throw InputError("control.twice", place_of(context, "batteries"),
                         fmt::format("controller '{}' lists the battery '{}' twice", context.name, name),
                         "list each battery once");
      declare_battery(context, name);
    }
    if (!single_) combine_texts();
    bus_ = &context.node->bus();
    topic_ = context.node->advertise<BatteryState>("~/battery_state", Qos::system_default_publisher());
    each_topic_ = context.node->advertise<control_msgs::msg::BatteryStateArray>(
        "~/raw_battery_states", Qos::system_default_publisher());
  }

  void publish_state(Time now) override {
    const auto stamp = to_time_msg(bus_->stamp(now));
    for (std::size_t i = 0; i < batteries_.size(); ++i) {
      each_.battery_states[i].header.stamp = stamp;
      read_battery(batteries_[i], each_.battery_states[i]);
    }
    if (single_)
      message_.voltage = static_cast<float>(value(0));
    else
      combine();
    message_.header.stamp = stamp;
    if (each_topic_.has_listeners()) each_topic_.publish(each_, now);
    if (topic_.has_listeners()) topic_.publish(message_, now);
  }

 private:
  // The state interfaces of a battery beside its voltage, in their order.
  enum Part { temperature, current, charge, percentage, status, health, present, kParts };
  struct Battery {
    std::array<std::optional<std::size_t>, kParts> handles;  // nullopt: it is not read
    std::size_t voltage = 0;
    float lowest = 0, highest = 0;  // V, at 0 and 100 %; NaN: not written
  };

  void declare_battery(ControllerContext& context, const std::string& name) {
    Battery battery;
    BatteryState state = unmeasured();
    state.header.frame_id = name;
    std::array<bool, kParts> is_read{};
    double lowest = kNaN, highest = kNaN, capacity = kNaN, design = kNaN;
    std::int64_t technology = 0;
    ControllerParameters list{{name + ".minimum_voltage", &lowest, "V, at 0 %", read_only()},
                              {name + ".maximum_voltage", &highest, "V, at 100 %", read_only()},
                              {name + ".capacity", &capacity, "A h, as last known", read_only()},
                              {name + ".design_capacity", &design, "A h", read_only()},
                              technology_parameter(name + ".power_supply_technology", technology),
                              {name + ".location", &state.location, "of the battery", read_only()},
                              {name + ".serial_number", &state.serial_number, "of the battery", read_only()}};
    for (std::size_t part = 0; part < kParts; ++part)
      list.emplace_back(fmt::format("interfaces.{}.{}", name, kPartNames[part]), &is_read[part],
                        "whether it is read from a state interface", read_only());
    declare_parameters(context, list);
    battery.voltage = interfaces_.size();
    interfaces_.push_back(name + "/battery_voltage");
    for (std::size_t part = 0; part < kParts; ++part) {
      if (!is_read[part]) continue;
      battery.handles[part] = interfaces_.size();
      interfaces_.push_back(name + "/" + kPartNames[part]);
    }
    battery.lowest = static_cast<float>(lowest);
    battery.highest = static_cast<float>(highest);
    if (!battery.handles[percentage] && battery.lowest >= battery.highest) {
      throw InputError(
          "control.battery_voltages", place_of(context, name + ".maximum_voltage"),
          fmt::format("the maximum_voltage of '{}', {} V, is not above its minimum_voltage, {} V", name,
                      battery.highest, battery.lowest),
          "correct one of them");
    }
    state.capacity = static_cast<float>(capacity);
    state.design_capacity = static_cast<float>(design);
    state.power_supply_technology = static_cast<std::uint8_t>(technology);
    batteries_.push_back(battery);
    each_.battery_states.push_back(std::move(state));
  }

  void combine_texts() {
    message_.capacity = message_.design_capacity = 0;
    message_.power_supply_technology = each_.battery_states.front().power_supply_technology;
    for (const BatteryState& one : each_.battery_states) {
      message_.capacity += one.capacity;
      message_.design_capacity += one.design_capacity;
      if (one.power_supply_technology != message_.power_supply_technology)
        message_.power_supply_technology = BatteryState::POWER_SUPPLY_TECHNOLOGY_UNKNOWN;
      message_.location += one.location + ", ";
      message_.serial_number += one.serial_number + ", ";
    }
  }

  void read_battery(const Battery& battery, BatteryState& out) const {
    const auto number = [&](Part part) {
      return battery.handles[part] ? static_cast<float>(value(*battery.handles[part])) : kNone;
    };
    out.voltage = static_cast<float>(value(battery.voltage));
    out.temperature = number(temperature);
    out.current = number(current);
    out.charge = number(charge);
    out.percentage = battery.handles[percentage]
                         ? number(percentage)
                         : (out.voltage - battery.lowest) * 100 / (battery.highest - battery.lowest);
    out.power_supply_status = enumerator(battery.handles[status] ? value(*battery.handles[status]) : 0);
    out.power_supply_health = enumerator(battery.handles[health] ? value(*battery.handles[health]) : 0);
    out.present = battery.handles[present] ? value(*battery.handles[present]) > 0
                                           : !std::isnan(out.voltage) && out.voltage != 0;
  }

  // Means of voltage, temperature, current and percentage, the sum of charges, the largest status and health,
  // over the batteries that have them.
  void combine() {
    const auto over_all = [&](float BatteryState::*field, bool mean, const auto& has) {
      float sum = 0;
      int count = 0;
      for (std::size_t i = 0; i < batteries_.size(); ++i) {
        if (!has(batteries_[i])) continue;
        sum += each_.battery_states[i].*field;
        ++count;
      }
      message_.*field = count == 0 ? kNone : mean ? sum / static_cast<float>(count) : sum;
    };
    const auto reads = [](Part part) {
      return [part](const Battery& battery) { return battery.handles[part].has_value(); };
    };
    over_all(&BatteryState::voltage, true, [](const Battery&) { return true; });
    over_all(&BatteryState::temperature, true, reads(temperature));
    over_all(&BatteryState::current, true, reads(current));
    over_all(&BatteryState::charge, false, reads(charge));
    over_all(&BatteryState::percentage, true, [](const Battery& battery) {
      return battery.handles[percentage] || battery.highest > battery.lowest;
    });
    message_.power_supply_status = message_.power_supply_health = 0;
    for (const BatteryState& one : each_.battery_states) {
      message_.power_supply_status = std::max(message_.power_supply_status, one.power_supply_status);
      message_.power_supply_health = std::max(message_.power_supply_health, one.power_supply_health);
    }
  }

  Bus* bus_ = nullptr;
  std::vector<Battery> batteries_;
  bool single_ = false;  // of the deprecated parameter sensor_name
  control_msgs::msg::BatteryStateArray each_;
  BatteryState message_;
  Publisher<control_msgs::msg::BatteryStateArray> each_topic_;
  Publisher<BatteryState> topic_;
};

}  // namespace

std::unique_ptr<Controller> make_battery_state_broadcaster() {
  return std::make_unique<BatteryStateBroadcaster>();
}

}  // namespace doppel
