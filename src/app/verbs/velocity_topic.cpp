#include "app/verbs/velocity_topic.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "doppel/ros/messages/rosgraph_msgs.h"

namespace doppel::app {
namespace {

using geometry_msgs::msg::Twist;
using geometry_msgs::msg::TwistStamped;
using SteadyClock = std::chrono::steady_clock;

constexpr const char* kClockTopic = "/clock";
constexpr auto kDiscoveryTime = std::chrono::seconds(2);
constexpr auto kFlushTime = std::chrono::milliseconds(100);

bool drives(const std::string& type) {
  return type == Twist::kType || type == TwistStamped::kType;
}

std::vector<std::string> candidates(Client& twin) {
  std::vector<std::string> found;
  for (const auto& [name, topic] : twin.topics()) {
    const bool in_namespace = robot_namespace().empty() || name.starts_with(robot_namespace() + "/");
    if (drives(topic.type) && !topic.subscribers.empty() && !is_hidden(name) && in_namespace)
      found.push_back(name);
  }
  if (found.size() < 2) return found;
  std::vector<std::string> usual;
  std::ranges::copy_if(found, std::back_inserter(usual),
                       [](const std::string& name) { return name.ends_with("/cmd_vel"); });
  return usual.empty() ? found : usual;
}

}  // namespace

VelocityTopic find_velocity_topic(Client& twin, const std::string& asked, std::optional<bool> stamped) {
  const auto until = SteadyClock::now() + kDiscoveryTime;
  if (!asked.empty()) {
    const std::string name = absolute(asked);
    const auto is_known = [&] {
      const auto there = twin.topics().find(name);
      return there != twin.topics().end() && !there->second.type.empty();
    };
    if (!stamped && !twin.wait_until(is_known, until)) {
      throw ClientError(fmt::format(
          "there is no topic {}; --stamped true or false publishes on it without a reader", name));
    }
    const std::string type = is_known() ? twin.topics().at(name).type : "";
    if (!stamped && !drives(type))
      throw ClientError(
          fmt::format("{} has type {}, not a velocity (geometry_msgs TwistStamped or Twist)", name, type));
    return {name, stamped.value_or(type == TwistStamped::kType)};
  }
  static_cast<void>(twin.wait_until([&] { return !candidates(twin).empty(); }, until));
  const std::vector<std::string> found = candidates(twin);
  if (found.empty()) {
    throw ClientError(
        "no node reads velocities (geometry_msgs TwistStamped or Twist): the robot has no base, or the "
        "base's controller is not active; see 'doppel control list_controllers'");
  }
  if (found.size() > 1) {
    throw ClientError(fmt::format(
        "several topics take velocities: {}; write one of them, as in 'doppel teleop keyboard {}'",
        fmt::join(found, ", "), found.front()));
  }
  return {found.front(), stamped.value_or(twin.topics().at(found.front()).type == TwistStamped::kType)};
}

VelocityPublisher::VelocityPublisher(Client& twin, VelocityTopic topic, ros2::Node* node)
    : twin_(twin), topic_(std::move(topic)), node_(node) {
  if (node != nullptr && topic_.stamped) {
    stamped_ = node->create_publisher<TwistStamped>(topic_.name);
    stamped_->wait_for_subscriptions(1, kDiscoveryTime);
  } else if (node != nullptr) {
    plain_ = node->create_publisher<Twist>(topic_.name);
    plain_->wait_for_subscriptions(1, kDiscoveryTime);
  }
  if (!topic_.stamped || !twin_.topics().contains(kClockTopic)) return;
  twin_.subscribe(kClockTopic);
  // Without the first time, the first commands would have stamps of this machine, and be far in the future.
  const auto until = SteadyClock::now() + kDiscoveryTime;
  while (!clock_ && SteadyClock::now() < until) {
    receive();
    if (!clock_)
      static_cast<void>(
          twin_.wait_until([] { return false; }, SteadyClock::now() + std::chrono::milliseconds(5)));
  }
}

void VelocityPublisher::receive(const Other& other) {
  twin_
      .sync();  // reads what has arrived; otherwise the clock of the first command after a pause would be old
  Client::Received message;
  while (twin_.next(message, SteadyClock::now())) {
    if (message.topic == kClockTopic) {
      clock_ = from_msg(decode<rosgraph_msgs::msg::Clock>(message.cdr).clock);
    } else if (other) {
      other(message);
    }
  }
}

template <class M>
void VelocityPublisher::send_message(const M& message, const std::optional<ros2::Publisher<M>>& publisher) {
  if (publisher) return publisher->publish(message);
  twin_.publish(topic_.name, std::string(M::kType), to_cdr(message));
  twin_.sync();
}

void VelocityPublisher::send(const Twist& twist) {
  if (!topic_.stamped) return send_message(twist, plain_);
  TwistStamped message;
  message.header.stamp = to_time_msg(clock_.value_or(system_time()));
  message.header.frame_id = frame_;
  message.twist = twist;
  send_message(message, stamped_);
}

void VelocityPublisher::flush() {
  if (node_ != nullptr) node_->context().spin_for(kFlushTime);
}

}  // namespace doppel::app
