#include <fmt/format.h>

#include <utility>

#include "doppel/control/controllers/detail/broadcasters.h"
#include "doppel/control/manager/joint_list.h"
#include "doppel/ros/messages/geometry_msgs.h"

namespace doppel {
namespace {

constexpr std::array kParts{"force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z"};

// The message has NaN for interfaces that are not named. Offsets are added before the multiplication, as
// there.
class ForceTorqueBroadcaster : public MessageBroadcaster<geometry_msgs::msg::WrenchStamped> {
 public:
  void on_init(ControllerContext& context) override {
    declare_parameters(context, {frame_parameter(message_.header.frame_id, "tool0")});
    choose_interfaces(context);
    ControllerParameters list;
    for (std::size_t i = 0; i < kParts.size(); ++i) {
      list.emplace_back(fmt::format("offset.{}", kParts[i]), &offset_[i], "added to the value, N or N m");
      list.emplace_back(fmt::format("multiplier.{}", kParts[i]), &multiplier_[i],
                        "of the sum of value and offset");
    }
    declare_parameters(context, list);
    for (const ControllerParameter& one : list) follow_field(context.node->parameters(), one);
    bool filtered = false;
    if (context.overrides != nullptr) {
      for (const ParameterOverride& one : context.overrides->all()) {
        if (!one.name.starts_with("sensor_filter_chain.")) continue;
        context.overrides->find(one.name)->used = true;  // it is reported here
        if (std::exchange(filtered, true)) continue;
        log_diagnostic(
            *context.log, context.name,
            {Severity::warning, "control.filter_chain",
             "the filter chain is without effect: filters are not built; ~/wrench has the values as "
             "measured, and there is no ~/wrench_filtered",
             one.source, "filter in the node that reads ~/wrench"});
      }
    }
    advertise(context, "~/wrench");
  }

 private:
  void choose_interfaces(ControllerContext& context) {
    std::string sensor;
    std::array<std::string, kParts.size()> names;
    ControllerParameters list{
        {"sensor_name", &sensor, "prefix of the six usual state interfaces", read_only()}};
    for (std::size_t i = 0; i < kParts.size(); ++i)
      list.emplace_back(fmt::format("interface_names.{}", kParts[i]), &names[i],
                        "the whole name of the state interface", read_only());
    declare_parameters(context, list);
    for (std::size_t i = 0; i < kParts.size(); ++i) {
      read_[i] = !names[i].empty();
      if (read_[i]) interfaces_.push_back(names[i]);
    }
    const bool named = !interfaces_.empty();
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

  void fill() override {
    std::array<double, 6> out{};
    for (std::size_t i = 0, handle = 0; i < out.size(); ++i)
      out[i] = ((read_[i] ? value(handle++) : kNaN) + offset_[i]) * multiplier_[i];
    message_.wrench.force = {out[0], out[1], out[2]};
    message_.wrench.torque = {out[3], out[4], out[5]};
  }

  std::array<bool, 6> read_{};  // force x, y, z, torque x, y, z
  std::array<double, 6> offset_{}, multiplier_{1, 1, 1, 1, 1, 1};
};

}  // namespace

std::unique_ptr<Controller> make_force_torque_broadcaster() {
  return std::make_unique<ForceTorqueBroadcaster>();
}

}  // namespace doppel
