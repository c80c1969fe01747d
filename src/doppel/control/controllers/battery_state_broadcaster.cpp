#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "doppel/control/controllers/detail/state_broadcasters.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/joint_list.h"

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

float declare_number(ControllerContext& context, const std::string& name, const char* description) {
  return static_cast<float>(
      declare<double>(context.node->parameters(), context.overrides, name, kNaN, {description, true, {}}));
}

std::uint8_t declare_technology(ControllerContext& context, const std::string& name) {
  ParameterOptions options{"of sensor_msgs/msg/BatteryState; 0: unknown", true, {}};
  options.range = ParameterRange{0, 8};
  return static_cast<std::uint8_t>(
      declare<std::int64_t>(context.node->parameters(), context.overrides, name, 0, options));
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

}  // namespace

void BatteryStateBroadcaster::on_init(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  const auto names = declare<std::vector<std::string>>(parameters, context.overrides, "batteries", {},
                                                       {"prefixes of their state interfaces", true, {}});
  const auto sensor = declare<std::string>(parameters, context.overrides, "sensor_name", "",
                                           {"deprecated in Jazzy: one battery's", true, {}});
  const float design = declare_number(context, "design_capacity", "A h, of sensor_name");
  const std::uint8_t technology = declare_technology(context, "power_supply_technology");
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
    message_.design_capacity = design;
    message_.power_supply_technology = technology;
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

void BatteryStateBroadcaster::declare_battery(ControllerContext& context, const std::string& name) {
  Parameters& parameters = context.node->parameters();
  Battery battery;
  battery.voltage = interfaces_.size();
  interfaces_.push_back(name + "/battery_voltage");
  for (std::size_t part = 0; part < kParts; ++part) {
    const bool is_read =
        declare<bool>(parameters, context.overrides, fmt::format("interfaces.{}.{}", name, kPartNames[part]),
                      false, {"whether it is read from a state interface", true, {}});
    if (!is_read) continue;
    battery.handles[part] = interfaces_.size();
    interfaces_.push_back(name + "/" + kPartNames[part]);
  }
  battery.lowest = declare_number(context, name + ".minimum_voltage", "V, at 0 %");
  battery.highest = declare_number(context, name + ".maximum_voltage", "V, at 100 %");
  if (!battery.handles[percentage] && battery.lowest >= battery.highest) {
    throw InputError("control.battery_voltages", place_of(context, name + ".maximum_voltage"),
                     fmt::format("the maximum_voltage of '{}', {} V, is not above its minimum_voltage, {} V",
                                 name, battery.highest, battery.lowest),
                     "correct one of them");
  }
  BatteryState state = unmeasured();
  state.header.frame_id = name;
  state.capacity = declare_number(context, name + ".capacity", "A h, as last known");
  state.design_capacity = declare_number(context, name + ".design_capacity", "A h");
  state.power_supply_technology = declare_technology(context, name + ".power_supply_technology");
  state.location = declare<std::string>(parameters, context.overrides, name + ".location", "",
                                        {"of the battery", true, {}});
  state.serial_number = declare<std::string>(parameters, context.overrides, name + ".serial_number", "",
                                             {"of the battery", true, {}});
  batteries_.push_back(battery);
  each_.battery_states.push_back(std::move(state));
}

void BatteryStateBroadcaster::combine_texts() {
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

void BatteryStateBroadcaster::read_battery(const Battery& battery, BatteryState& out) const {
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

// Means of voltage, temperature, current and percentage, the sum of charges, the largest status and health, over the
// batteries that have them.
void BatteryStateBroadcaster::combine() {
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

void BatteryStateBroadcaster::publish_state(Time now) {
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

}  // namespace doppel
