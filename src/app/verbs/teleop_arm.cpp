#include "app/verbs/teleop_arm.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/verbs/controllers.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/trajectory_msgs.h"

namespace doppel::app {

TeleopArm::TeleopArm(Client& twin) : twin_(twin), states_(absolute("joint_states")) {
  const std::vector<std::string> managers = find_managers(twin);
  const std::string own = absolute("controller_manager");
  if (std::ranges::find(managers, own) == managers.end()) return;
  for (const auto& controller : list_controllers(twin, own)) {
    if (controller.state != "active" ||
        controller.type.find("JointTrajectoryController") == std::string::npos)
      continue;
    Group group{absolute(controller.name + "/joint_trajectory"), joints_of(controller)};
    names_.insert(names_.end(), group.joints.begin(), group.joints.end());
    groups_.push_back(std::move(group));
  }
  if (!names_.empty() && twin_.topics().contains(states_)) twin_.subscribe(states_);
}

void TeleopArm::take(const Client::Received& message) {
  if (message.topic != states_) return;
  const auto state = decode<sensor_msgs::msg::JointState>(message.cdr);
  for (std::size_t i = 0; i < std::min(state.name.size(), state.position.size()); ++i)
    positions_[state.name[i]] = state.position[i];
}

bool TeleopArm::move(std::size_t index, double rate, double seconds) {
  if (index >= names_.size()) return false;
  const std::string& joint = names_[index];
  const auto group = std::ranges::find_if(
      groups_, [&](const Group& g) { return std::ranges::find(g.joints, joint) != g.joints.end(); });
  trajectory_msgs::msg::JointTrajectory message;
  message.joint_names = group->joints;
  message.points.resize(1);
  for (const std::string& name : group->joints) {
    if (!positions_.contains(name)) return false;
    targets_.try_emplace(name, positions_[name]);
    if (name == joint) targets_[name] += rate * seconds;
    message.points[0].positions.push_back(targets_[name]);
  }
  message.points[0].time_from_start = to_duration_msg(from_seconds(seconds));
  twin_.publish(group->topic, std::string(trajectory_msgs::msg::JointTrajectory::kType), to_cdr(message));
  twin_.sync();
  return true;
}

}  // namespace doppel::app
