#include "doppel/lab/resimulation/joint_panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {
namespace {

using JointCurves = std::map<std::string, PlotCurve>;  // "/left/joint_states elbow"

JointCurves joint_curves(BagReader& bag, const std::string& label, std::uint64_t start) {
  JointCurves out;
  bag.seek(0, UINT64_MAX, {.types = {std::string(sensor_msgs::msg::JointState::kType)}});
  sensor_msgs::msg::JointState state;
  while (const auto message = bag.next()) {
    const std::string& topic = bag.contents().topics[message->topic].name;
    if (!topic.ends_with("joint_states") || !from_cdr(message->data, state)) continue;
    const double time = 1e-9 * (static_cast<double>(message->log_time) - static_cast<double>(start));
    for (std::size_t i = 0; i < std::min(state.name.size(), state.position.size()); ++i) {
      PlotCurve& curve = out[topic == "/joint_states" ? state.name[i] : topic + " " + state.name[i]];
      curve.label = label;
      curve.times.push_back(time);
      curve.values.push_back(state.position[i]);
    }
  }
  return out;
}

struct Difference {
  double largest = 0, time = 0;
};

// At the times that both have.
Difference difference_of(const PlotCurve& a, const PlotCurve& b) {
  Difference out;
  for (std::size_t i = 0, k = 0; i < a.times.size() && k < b.times.size();) {
    if (a.times[i] == b.times[k]) {
      const double distance = std::abs(a.values[i] - b.values[k]);
      if (distance > out.largest) out = {distance, a.times[i]};
      ++i;
      ++k;
    } else if (a.times[i] < b.times[k]) {
      ++i;
    } else {
      ++k;
    }
  }
  return out;
}

}  // namespace

std::vector<PlotPanel> joint_panels(BagReader& first, const std::string& first_label, BagReader& second,
                                    const std::string& second_label, std::size_t most) {
  const std::uint64_t start = first.contents().start;
  // The second run of a black box begins before its recording.
  const bool share_time = second.contents().start <= start && start <= second.contents().end;
  const JointCurves a = joint_curves(first, first_label, start);
  const JointCurves b = joint_curves(second, second_label, share_time ? start : second.contents().start);
  std::vector<std::pair<double, PlotPanel>> panels;
  for (const auto& [name, curve] : a) {
    const auto other = b.find(name);
    if (other == b.end()) continue;
    const Difference difference = difference_of(curve, other->second);
    panels.push_back({difference.largest,
                      {name,
                       "rad or m",
                       difference.largest == 0 ? "equal"
                                               : fmt::format("largest difference {:.3g} at {:.2f} s",
                                                             difference.largest, difference.time),
                       {curve, other->second}}});
  }
  std::ranges::stable_sort(panels, std::greater(), &std::pair<double, PlotPanel>::first);
  std::vector<PlotPanel> out;
  for (auto& [largest, panel] : panels) {
    if (out.size() < most) out.push_back(std::move(panel));
  }
  return out;
}

}  // namespace doppel
