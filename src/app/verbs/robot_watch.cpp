#include "app/verbs/robot_watch.h"

#include "doppel/description/urdf/load.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kStateTimeout = std::chrono::seconds(2);

bool is_published(Client& twin, const std::string& topic) {
  const auto found = twin.topics().find(topic);
  return found != twin.topics().end() && !found->second.publishers.empty();
}

double element(const std::vector<double>& values, std::size_t i) {
  return i < values.size() ? values[i] : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

RobotWatch::RobotWatch(Client& twin, const std::string& manager)
    : states_(expand_name("joint_states", manager)),
      description_(expand_name("robot_description", manager)),
      stop_(expand_name("~/emergency_stop_active", manager)),
      loads_topic_(expand_name("doppel/joint_loads", manager)) {
  const bool described = is_published(twin, description_), stoppable = is_published(twin, stop_);
  if (described) twin.subscribe(description_);
  if (stoppable) twin.subscribe(stop_);
  if (is_published(twin, loads_topic_)) twin.subscribe(loads_topic_);
  twin.subscribe(states_);
  const auto until = Clock::now() + kStateTimeout;
  Client::Received message;
  while (joints_.empty() || (described && !description_came_) || (stoppable && !stopped_)) {
    if (!twin.next(message, until)) break;
    static_cast<void>(take(message));
  }
  if (joints_.empty() && !is_stopped()) {
    throw ClientError(fmt::format(
        "no message arrives on {}; is the twin paused, or the joint_state_broadcaster inactive?", states_));
  }
}

bool RobotWatch::take(const Client::Received& message) {
  if (message.topic == description_) {
    read_description(decode<std_msgs::msg::String>(message.cdr).data);
    check_description();
  } else if (message.topic == stop_) {
    stopped_ = decode<std_msgs::msg::Bool>(message.cdr).data;
  } else if (message.topic == loads_topic_) {
    const auto loads = decode<doppel_msgs::msg::JointLoads>(message.cdr);
    for (std::size_t i = 0; i < loads.joint_names.size(); ++i)
      loads_[loads.joint_names[i]] = {element(loads.efforts, i), element(loads.effort_limits, i)};
  } else if (message.topic == states_) {
    const auto state = decode<sensor_msgs::msg::JointState>(message.cdr);
    stamp_ = from_msg(state.header.stamp);
    const std::size_t count = joints_.size();
    for (std::size_t i = 0; i < std::min(state.name.size(), state.position.size()); ++i)
      joints_[state.name[i]] = {state.position[i], element(state.velocity, i), element(state.effort, i)};
    if (joints_.size() != count) check_description();
    return true;
  }
  return false;
}

void RobotWatch::read_description(const std::string& urdf) {
  description_came_ = true;
  Diagnostics findings;  // the twin has printed them at its start
  PackageResolver packages;
  try {
    model_ = compile_model(parse_urdf(urdf, description_, packages, findings), BaseKind::fixed, findings);
  } catch (const InputError& error) {
    print_note(
        fmt::format("warning: {} cannot be read, so limits are not checked\n{}", description_, error.what()));
  }
}

// Limits and names of another robot must not decide how far this one moves.
void RobotWatch::check_description() const {
  for (const auto& [name, sample] : joints_) {
    if (!model_ || find(name) != nullptr) continue;
    throw ClientError(fmt::format(
        "{} describes another robot, '{}': it has no joint '{}', which {} has; two programs publish "
        "there (doppel topic info {} -v): end one of them, or give it a domain of its own (--domain)",
        description_, model_->name, name, states_, description_));
  }
}

std::optional<double> RobotWatch::position(const std::string& joint) const {
  const auto found = joints_.find(joint);
  return found == joints_.end() ? std::nullopt : std::optional(found->second.position);
}

DriveLoad RobotWatch::load(const std::string& name) const {
  const auto published = loads_.find(name);
  if (published != loads_.end()) return published->second;
  DriveLoad load;
  const auto sample = joints_.find(name);
  if (sample != joints_.end()) load.effort = sample->second.effort;
  if (const ModelJoint* joint = find(name)) load.limit = joint->effort;
  return load;
}

const ModelJoint* RobotWatch::find(const std::string& joint) const {
  const int index = model_ ? model_->find_joint(joint) : -1;
  return index < 0 ? nullptr : &model_->joints[static_cast<std::size_t>(index)];
}

}  // namespace doppel::app
