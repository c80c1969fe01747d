// Publishes the state interfaces of the hardware on /joint_states (sensor_msgs/msg/JointState) and
// /dynamic_joint_states (control_msgs/msg/DynamicJointState), in the order of the hardware. Compatible
// with ros2_controllers' broadcaster.

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "doppel/control/controllers/detail/broadcasters.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/joint_list.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {
namespace {

using Names = std::vector<std::string>;

std::size_t row_of(std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  names.push_back(name);
  return names.size() - 1;
}

class JointStateBroadcaster : public Controller {
 public:
  void on_init(ControllerContext& context) override {
    context_ = &context;
    bool local = false, publishes_dynamic = true;
    std::string frame = "base_link";
    declare_parameters(context,
                       {{"joints", &joints_, "joints whose states are published; empty: all", read_only()},
                        {"interfaces", &interfaces_, "of each joint; empty: all", read_only()},
                        {"extra_joints", &extra_joints_, "published with zeros", read_only()},
                        {"use_local_topics", &local, "~/joint_states ...", read_only()},
                        {"use_urdf_to_filter", &only_model_joints_,
                         "publish only joints of the description on /joint_states", read_only()},
                        {"publish_dynamic_joint_states", &publishes_dynamic,
                         "publish all interfaces on /dynamic_joint_states; deprecated", read_only()},
                        {"frame_id", &frame, "of the headers", read_only()}});
    const char* fields[] = {kPosition, kVelocity, kEffort};
    for (int field = 0; field < 3; ++field) {
      std::string name = fields[field];
      declare_parameters(context, {{fmt::format("map_interface_to_joint_state.{}", name), &name,
                                    "the interface that fills this field", read_only()}});
      field_of_[name] = field;
    }
    states_.header.frame_id = dynamic_.header.frame_id = frame;
    joints_ = check_joints(context, "joints", joints_, JointUse::observed);
    if (joints_.empty() != interfaces_.empty()) {
      log_diagnostic(
          *context.log, context.name,
          {Severity::warning, "control.broadcasts_all",
           fmt::format("'{}' alone has no effect: as long as '{}' is empty, every state is published",
                       joints_.empty() ? "interfaces" : "joints", joints_.empty() ? "joints" : "interfaces"),
           place_of(context, joints_.empty() ? "interfaces" : "joints"), "set both, or neither"});
    }
    bus_ = &context.node->bus();
    const std::string prefix = local ? "~/" : "";
    const Qos qos = Qos::system_default_publisher();
    states_topic_ = context.node->advertise<sensor_msgs::msg::JointState>(prefix + "joint_states", qos);
    if (publishes_dynamic)
      dynamic_topic_ =
          context.node->advertise<control_msgs::msg::DynamicJointState>(prefix + "dynamic_joint_states", qos);
  }

  [[nodiscard]] InterfaceConfiguration command_interfaces() const override { return {}; }

  [[nodiscard]] InterfaceConfiguration state_interfaces() const override {
    if (joints_.empty() || interfaces_.empty()) return {InterfaceConfiguration::Kind::all, {}};
    InterfaceConfiguration wanted{InterfaceConfiguration::Kind::individual, {}};
    for (const std::string& joint : joints_) {
      for (const std::string& interface : interfaces_) wanted.names.push_back(joint + "/" + interface);
    }
    return wanted;
  }

  Status on_activate() override {
    if (state_handles.empty() && extra_joints_.empty()) {
      return Status::refused("the hardware exports no state interfaces to publish");
    }
    lay_out_joint_states();
    lay_out_dynamic_joint_states();
    return {};
  }

  void update(Time now, Duration /*period*/) override { publish_state(now); }
  // Its messages are functions of the states alone.
  [[nodiscard]] bool save(SavedSlot& /*slot*/) const override { return true; }

  void publish_state(Time now) override {
    if (states_topic_.has_listeners()) {
      std::vector<double>* const fields[] = {&states_.position, &states_.velocity, &states_.effort};
      for (const Link& link : to_states_) (*fields[link.column])[link.row] = state_handles[link.handle].get();
      states_.header.stamp = to_time_msg(bus_->stamp(now));
      states_topic_.publish(states_, now);
    }
    if (dynamic_topic_.has_listeners()) {
      for (const Link& link : to_dynamic_) {
        dynamic_.interface_values[link.row].values[link.column] = state_handles[link.handle].get();
      }
      dynamic_.header.stamp = to_time_msg(bus_->stamp(now));
      dynamic_topic_.publish(dynamic_, now);
    }
  }

 private:
  // The place of a state handle's value in a message.
  struct Link {
    std::size_t handle = 0, row = 0, column = 0;
  };

  [[nodiscard]] bool belongs_in_joint_states(const std::string& prefix) const {
    return !only_model_joints_ || context_->model->find_joint(prefix) >= 0;
  }

  void lay_out_joint_states() {
    states_.name.clear();
    to_states_.clear();
    for (std::size_t h = 0; h < state_handles.size(); ++h) {
      const std::string joint = state_handles[h].prefix();
      const auto field = field_of_.find(state_handles[h].interface_name());
      if (field == field_of_.end() || !belongs_in_joint_states(joint)) continue;
      to_states_.push_back({h, row_of(states_.name, joint), static_cast<std::size_t>(field->second)});
    }
    const std::size_t measured = states_.name.size();
    for (const std::string& joint : extra_joints_) row_of(states_.name, joint);
    for (auto* field : {&states_.position, &states_.velocity, &states_.effort}) {
      field->assign(states_.name.size(), 0.0);
      std::fill_n(field->begin(), measured, kNaN);  // as in ROS 2: a value without a state interface is NaN
    }
  }

  void lay_out_dynamic_joint_states() {
    dynamic_.joint_names.clear();
    dynamic_.interface_values.clear();
    to_dynamic_.clear();
    for (std::size_t h = 0; h < state_handles.size(); ++h) {
      const std::size_t row = row_of(dynamic_.joint_names, state_handles[h].prefix());
      dynamic_.interface_values.resize(dynamic_.joint_names.size());
      auto& values = dynamic_.interface_values[row];
      to_dynamic_.push_back({h, row, values.values.size()});
      values.interface_names.push_back(state_handles[h].interface_name());
      values.values.push_back(kNaN);
    }
    for (const std::string& joint : extra_joints_) {
      const std::size_t before = dynamic_.joint_names.size();
      row_of(dynamic_.joint_names, joint);
      if (dynamic_.joint_names.size() == before) continue;
      dynamic_.interface_values.push_back({{kPosition, kVelocity, kEffort}, {0.0, 0.0, 0.0}});
    }
  }

  const ControllerContext* context_ = nullptr;
  std::vector<std::string> joints_, interfaces_, extra_joints_;
  std::map<std::string, int> field_of_;  // interface name -> 0 position, 1 velocity, 2 effort
  bool only_model_joints_ = true;

  Bus* bus_ = nullptr;
  Publisher<sensor_msgs::msg::JointState> states_topic_;
  Publisher<control_msgs::msg::DynamicJointState> dynamic_topic_;
  sensor_msgs::msg::JointState states_;  // both are sized at activation, and only filled in the loop
  control_msgs::msg::DynamicJointState dynamic_;
  std::vector<Link> to_states_, to_dynamic_;
};

}  // namespace

std::unique_ptr<Controller> make_joint_state_broadcaster() {
  return std::make_unique<JointStateBroadcaster>();
}

}  // namespace doppel
