#include "doppel/control/controllers/detail/broadcasters.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {
namespace {

// The names are published once, latched, the values in each update.
class StateInterfacesBroadcaster : public MessageBroadcaster<control_msgs::msg::Float64Values> {
 public:
  void on_init(ControllerContext& context) override {
    declare_parameters(
        context, {{"interfaces", &interfaces_, "the whole names of state interfaces", read_only(),
                   required_value("[joint/position, imu/angular_velocity.x]", ", so it publishes nothing")}});
    names_topic_ = context.node->advertise<control_msgs::msg::Keys>("~/names", {.depth = 1, .latched = true});
    advertise(context, "~/values");
  }
  Status on_configure() override {
    message_.values.assign(interfaces_.size(), kNaN);
    names_.keys = interfaces_;
    names_.header.stamp = to_time_msg(bus_->stamp(bus_->now()));
    names_topic_.publish(names_, bus_->now());
    return {};
  }

 private:
  void fill() override {
    for (std::size_t i = 0; i < state_handles.size(); ++i) message_.values[i] = value(i);
  }

  control_msgs::msg::Keys names_;
  Publisher<control_msgs::msg::Keys> names_topic_;
};

}  // namespace

std::unique_ptr<Controller> make_state_interfaces_broadcaster() {
  return std::make_unique<StateInterfacesBroadcaster>();
}

}  // namespace doppel
