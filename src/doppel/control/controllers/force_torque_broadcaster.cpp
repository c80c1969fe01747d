#include <fmt/format.h>

#include "doppel/control/controllers/detail/broadcaster_parameters.h"
#include "doppel/control/controllers/detail/sensor_broadcasters.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

constexpr std::array kParts{"force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z"};

}  // namespace

void ForceTorqueBroadcaster::choose_interfaces(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  const auto sensor = declare<std::string>(parameters, context.overrides, "sensor_name", "",
                                           {"prefix of the six usual state interfaces", true, {}});
  bool named = false;
  for (std::size_t i = 0; i < kParts.size(); ++i) {
    const auto name =
        declare<std::string>(parameters, context.overrides, fmt::format("interface_names.{}", kParts[i]), "",
                             {"the whole name of the state interface", true, {}});
    read_[i] = !name.empty();
    named = named || read_[i];
    if (read_[i]) interfaces_.push_back(name);
  }
  if (sensor.empty() != named) {
    const auto [rule, problem] =
        named ? std::pair("control.conflicting_parameters", "both 'sensor_name' and 'interface_names'")
              : std::pair("control.empty_parameter", "neither 'sensor_name' nor 'interface_names'");
    throw InputError(rule, place_of(context, "sensor_name"),
                     fmt::format("controller '{}' has {}", context.name, problem),
                     "write sensor_name: NAME, or interface_names: {force: {x: ...}, ...}, not both");
  }
  if (named) return;
  read_.fill(true);
  read(sensor, {kParts.begin(), kParts.end()});
}

void ForceTorqueBroadcaster::on_init(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  message_.header.frame_id = declare_required_text(context, "frame_id", "frame of the values", "tool0");
  choose_interfaces(context);
  for (std::size_t i = 0; i < kParts.size(); ++i) {
    offset_[i] = declare<double>(parameters, context.overrides, fmt::format("offset.{}", kParts[i]), 0.0,
                                 {"added to the value, N or N m", false, {}});
    multiplier_[i] = declare<double>(parameters, context.overrides, fmt::format("multiplier.{}", kParts[i]),
                                     1.0, {"of the sum of value and offset", false, {}});
  }
  parameters.on_change([this](const std::string& name, const ParameterValue& value) {
    for (std::size_t i = 0; i < kParts.size(); ++i) {
      if (name == std::string("offset.") + kParts[i]) offset_[i] = std::get<double>(value);
      if (name == std::string("multiplier.") + kParts[i]) multiplier_[i] = std::get<double>(value);
    }
  });
  bool filtered = false;
  if (context.overrides != nullptr) {
    for (const ParameterOverride& one : context.overrides->all()) {
      if (!one.name.starts_with("sensor_filter_chain.")) continue;
      context.overrides->find(one.name)->used = true;  // it is reported here
      if (std::exchange(filtered, true)) continue;
      log_diagnostic(*context.log, context.name,
                     {Severity::warning, "control.filter_chain",
                      "the filter chain is without effect: filters are not built; ~/wrench has the values as "
                      "measured, and there is no ~/wrench_filtered",
                      one.source, "filter in the node that reads ~/wrench"});
    }
  }
  bus_ = &context.node->bus();
  topic_ =
      context.node->advertise<geometry_msgs::msg::WrenchStamped>("~/wrench", Qos::system_default_publisher());
}

void ForceTorqueBroadcaster::publish_state(Time now) {
  if (!topic_.has_listeners()) return;
  std::array<double, 6> out{};
  for (std::size_t i = 0, handle = 0; i < out.size(); ++i)
    out[i] = ((read_[i] ? value(handle++) : kNaN) + offset_[i]) * multiplier_[i];
  message_.wrench.force = {out[0], out[1], out[2]};
  message_.wrench.torque = {out[3], out[4], out[5]};
  message_.header.stamp = to_time_msg(bus_->stamp(now));
  topic_.publish(message_, now);
}

}  // namespace doppel
