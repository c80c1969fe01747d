#include <fmt/format.h>

#include "doppel/control/controllers/detail/state_broadcasters.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {

void StateInterfacesBroadcaster::on_init(ControllerContext& context) {
  interfaces_ = declare<std::vector<std::string>>(context.node->parameters(), context.overrides, "interfaces",
                                                  {}, {"the whole names of state interfaces", true, {}});
  if (interfaces_.empty()) {
    throw InputError(
        "control.empty_parameter", place_of(context, "interfaces"),
        fmt::format("controller '{}' has no 'interfaces', so it publishes nothing", context.name),
        "write interfaces: [joint/position, imu/angular_velocity.x] below its ros__parameters");
  }
  bus_ = &context.node->bus();
  names_topic_ = context.node->advertise<control_msgs::msg::Keys>("~/names", {.depth = 1, .latched = true});
  topic_ =
      context.node->advertise<control_msgs::msg::Float64Values>("~/values", Qos::system_default_publisher());
}

Status StateInterfacesBroadcaster::on_configure() {
  message_.values.assign(interfaces_.size(), kNaN);
  names_.keys = interfaces_;
  names_.header.stamp = to_time_msg(bus_->stamp(bus_->now()));
  names_topic_.publish(names_, bus_->now());
  return {};
}

void StateInterfacesBroadcaster::publish_state(Time now) {
  if (!topic_.has_listeners()) return;
  for (std::size_t i = 0; i < state_handles.size(); ++i) message_.values[i] = value(i);
  message_.header.stamp = to_time_msg(bus_->stamp(now));
  topic_.publish(message_, now);
}

}  // namespace doppel
