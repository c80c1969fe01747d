#include "app/verbs/arrival.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;

// In the time of the joint states' stamps.
constexpr Duration kArrivedTime = std::chrono::milliseconds(100);   // at the targets without leaving them
constexpr Duration kStalledTime = std::chrono::milliseconds(1000);  // without coming nearer
constexpr auto kSilenceTimeout = std::chrono::seconds(5);           // wall-clock time without a state
constexpr auto kDeliveryTime = std::chrono::milliseconds(200);      // wall-clock time of a command on its way
constexpr Duration kLateTime = std::chrono::seconds(10);            // after the commands
constexpr double kApproach =
    0.05;  // part of the remaining distance: a smaller approach in kStalledTime is none
constexpr double kProgress = 1e-3;          // rad or m: a smaller approach in kStalledTime is none
constexpr double kStillSpeed = 0.01;        // rad/s or m/s
constexpr double kFullEffort = 0.98;        // of the limit
constexpr double kAngleTolerance = 0.02;    // rad
constexpr double kLengthTolerance = 0.002;  // m

}  // namespace

const char* joint_unit(const ModelJoint& joint) {
  return joint.type == JointType::prismatic ? "m" : "rad";
}

double distance_to(const ModelJoint* joint, double from, double to) {
  const bool turns = joint != nullptr && joint->type == JointType::continuous;
  return std::abs(turns ? std::remainder(to - from, 2 * std::numbers::pi) : to - from);
}

double Arrival::tolerance_of(const ModelJoint* joint) const {
  if (tolerance_ > 0) return tolerance_;
  return joint != nullptr && joint->type == JointType::prismatic ? kLengthTolerance : kAngleTolerance;
}

double Arrival::remaining(const RobotWatch& robot, const Positions& targets) const {
  double sum = 0;
  for (const auto& [name, target] : targets) {
    const ModelJoint* joint = robot.find(name);
    const double distance = distance_to(joint, robot.position(name).value_or(target), target);
    if (!(distance <= tolerance_of(joint))) sum += distance;
  }
  return sum;
}

void Arrival::wait(const RobotWatch& robot, const Positions& targets, const Receive& receive) const {
  double best = remaining(robot, targets);
  const Time begin = robot.stamp();
  const auto earliest = Clock::now() + kDeliveryTime;
  Time approached = begin;
  Time away = robot.stamp();  // when a joint was not at its target for the last time
  Time newest = begin;
  auto heard = Clock::now();  // when a newer state came
  while (receive(Clock::now() + kSilenceTimeout)) {
    if (robot.stamp() != newest) {
      newest = robot.stamp();
      heard = Clock::now();
    }
    // Hardware that has failed reports no states, while other messages go on.
    if (Clock::now() - heard >= kSilenceTimeout) return;
    const double left = remaining(robot, targets);
    if (left == 0) {
      if (robot.stamp() - away >= kArrivedTime) return;
      continue;
    }
    away = robot.stamp();
    if (left < best - std::max(kProgress, kApproach * best)) {
      best = left;
      approached = robot.stamp();
    }
    // A twin that is faster than real time needs wall-clock time for a command on its way.
    const bool is_over = robot.stamp() - approached >= kStalledTime || robot.stamp() - begin >= kLateTime;
    if ((is_over && Clock::now() >= earliest) || !std::isfinite(left)) return;
  }
}

std::string Arrival::why_not(const RobotWatch& robot, const std::string& name, double target) const {
  const auto found = robot.joints().find(name);
  if (found == robot.joints().end()) return fmt::format("joint_states does not contain '{}'", name);
  const JointSample& sample = found->second;
  const ModelJoint* joint = robot.find(name);
  const double distance = distance_to(joint, sample.position, target);
  if (distance <= tolerance_of(joint)) return "";
  const char* unit = joint == nullptr ? "" : joint_unit(*joint);
  const std::string place = fmt::format("'{}' is at {:.4f}, {:.4g} {} from its target {:.4f}", name,
                                        sample.position, distance, unit, target);
  const DriveLoad load = robot.load(name);
  if (std::abs(load.effort) >= kFullEffort * load.limit) {
    return fmt::format(
        "{}: its drive is at its effort limit of {:.4g} {}, so the load is too heavy or something is in the "
        "way",
        place, load.limit, joint != nullptr && joint->type == JointType::prismatic ? "N" : "N m");
  }
  if (std::abs(sample.velocity) > kStillSpeed) {
    return fmt::format(
        "{}: it moves at {:.3g} {}/s without coming nearer; does it oscillate, or does another "
        "program command it?",
        place, sample.velocity, unit);
  }
  return place +
         ": it stands still; is something in the way, is the drive too soft for its load, or does "
         "another program command it?";
}

}  // namespace doppel::app
