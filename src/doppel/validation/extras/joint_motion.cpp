#include "doppel/validation/extras/detail/joint_motion.h"

#include <algorithm>
#include <cmath>

#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/trajectory_msgs.h"

namespace doppel {
namespace {

constexpr const char* kClient = "/doppel_validate_extras";
constexpr double kLead = 0.1;  // s between a command and its begin

std::optional<JointWay> topic_way(const MachineRun& machine, int joint) {
  for (const JointWay& way : machine.ways(joint)) {
    if (way.interface == "position" && way.kind != JointWay::Kind::trajectory_action) return way;
  }
  return std::nullopt;
}

}  // namespace

JointMotion::JointMotion(MachineRun& machine, const std::vector<std::string>& joints)
    : machine_(machine), edge_(machine.twin().bus().attach(kClient)) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const int joint = machine.model().find_joint(joints[i]);
    const auto way = joint < 0 ? std::nullopt : topic_way(machine, joint);
    if (!way) {
      if (missing_.empty()) missing_ = joints[i];
      continue;
    }
    auto found =
        std::ranges::find(commands_, way->address, [](const Command& one) { return one.way.address; });
    if (found == commands_.end()) {
      commands_.push_back({*way, std::vector<std::optional<std::size_t>>(way->joints.size())});
      found = std::prev(commands_.end());
    }
    found->indices[way->index] = i;
  }
}

double JointMotion::period() const {
  return to_seconds(machine_.twin().robot().controller_manager().period());
}

std::vector<double> JointMotion::values(const Command& command, const Eigen::VectorXd& positions) const {
  std::vector<double> out;
  for (std::size_t i = 0; i < command.indices.size(); ++i) {
    const int joint = machine_.model().find_joint(command.way.joints[i]);
    out.push_back(command.indices[i] ? positions[static_cast<Eigen::Index>(*command.indices[i])]
                  : joint >= 0       ? machine_.position(joint)
                                     : 0.0);
  }
  return out;
}

void JointMotion::send_trajectory(const Command& command, const Course& course, double seconds, double step,
                                  Time begin) {
  trajectory_msgs::msg::JointTrajectory message;
  message.joint_names = command.way.joints;
  message.header.stamp = to_time_msg(begin);
  const int count = std::max(1, static_cast<int>(std::ceil(seconds / step)));
  const std::vector<double> start = values(command, course(0));
  for (int i = 1; i <= count; ++i) {
    auto& point = message.points.emplace_back();
    const double time = std::min(i * step, seconds);
    point.positions = values(command, course(time));
    for (std::size_t k = 0; k < start.size(); ++k)
      if (!command.indices[k]) point.positions[k] = start[k];
    point.time_from_start = to_duration_msg(from_seconds(time));
  }
  static_cast<void>(edge_->publish(kClient, command.way.address, message.kType, to_cdr(message)));
}

void JointMotion::send_values(const Command& command, const Eigen::VectorXd& positions) {
  std_msgs::msg::Float64MultiArray message;
  message.data = values(command, positions);
  static_cast<void>(edge_->publish(kClient, command.way.address, message.kType, to_cdr(message)));
}

bool JointMotion::run(const Course& course, double seconds, double step, double rest,
                      const std::function<void(double)>& after_step) {
  const Time begin = machine_.twin().now() + from_seconds(kLead);
  bool streams = false;
  for (const Command& command : commands_) {
    if (command.way.kind == JointWay::Kind::trajectory) {
      send_trajectory(command, course, seconds, step, begin);
    } else {
      streams = true;
    }
  }
  // The drive reaches each target of a stream a period later.
  const double ahead = period();
  double next = -kLead;
  return machine_.run(kLead + seconds + rest, [&] {
    const double time = to_seconds(machine_.twin().now() - begin);
    after_step(time);
    if (!streams || time < next) return;
    next = time + ahead - 1e-9;
    const Eigen::VectorXd positions = course(std::clamp(time + ahead, 0.0, seconds));
    for (const Command& command : commands_)
      if (command.way.kind == JointWay::Kind::forward) send_values(command, positions);
  });
}

}  // namespace doppel
