#include "app/verbs/tf_frames.h"

#include <algorithm>
#include <set>

#include "doppel/ros/messages/tf2_msgs.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kFramesTimeout = std::chrono::seconds(2);

}  // namespace

TfFrames::TfFrames(Client& twin) : twin_(twin) {
  for (const std::string& topic : {fixed_topic_, moving_topic_}) {
    if (twin_.topics().contains(topic)) twin_.subscribe(topic);
  }
}

bool TfFrames::gather(const std::function<bool()>& enough, Clock::time_point until) {
  while (!enough()) {
    Client::Received message;
    if (!twin_.next(message, until)) return false;
    take(message);
  }
  return true;
}

bool TfFrames::gather_all() {
  return gather([&] { return has_static_ && (has_dynamic_ || !moving_expected()); },
                Clock::now() + kFramesTimeout);
}

bool TfFrames::moving_expected() const {
  return !broadcasters(false).empty();
}

std::vector<std::string> TfFrames::broadcasters(bool fixed) const {
  const auto found = twin_.topics().find(fixed ? fixed_topic_ : moving_topic_);
  if (found == twin_.topics().end()) return {};
  std::vector<std::string> nodes = found->second.publishers;
  std::ranges::sort(nodes);
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

std::vector<std::string> TfFrames::names() const {
  std::set<std::string> names;
  for (const auto& [name, frame] : frames_) names.insert({name, frame.parent});
  return {names.begin(), names.end()};
}

bool TfFrames::look_up(const std::string& parent, const std::string& child, Pose& X, Time& stamp) const {
  Pose X_RootP, X_RootC;
  stamp = Time{};
  if (root_of(parent, X_RootP, stamp) != root_of(child, X_RootC, stamp)) return false;
  X = X_RootP.inverse() * X_RootC;
  return true;
}

void TfFrames::take(const Client::Received& message) {
  const bool fixed = message.topic == fixed_topic_;
  if (!fixed && message.topic != moving_topic_) return;
  (fixed ? has_static_ : has_dynamic_) = true;
  for (const auto& t : decode<tf2_msgs::msg::TFMessage>(message.cdr).transforms) {
    TfFrame& frame = frames_[t.child_frame_id];
    const auto& p = t.transform.translation;
    const auto& r = t.transform.rotation;
    frame.parent = t.header.frame_id;
    frame.X_PF = Eigen::Translation3d(p.x, p.y, p.z) * Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized();
    frame.stamp = from_msg(t.header.stamp);
    frame.fixed = fixed;
    if (frame.count++ == 0) frame.first_stamp = frame.stamp;
  }
}

std::string TfFrames::root_of(std::string name, Pose& X_RootF, Time& stamp) const {
  X_RootF = Pose::Identity();
  for (std::size_t steps = 0; steps <= frames_.size(); ++steps) {  // bounded: a loop has no root
    const auto found = frames_.find(name);
    if (found == frames_.end()) return name;
    X_RootF = found->second.X_PF * X_RootF;
    if (!found->second.fixed) stamp = std::max(stamp, found->second.stamp);
    name = found->second.parent;
  }
  throw ClientError(fmt::format("the frames around {} form a loop", name));
}

}  // namespace doppel::app
