#include "doppel/lab/base_report/detail/base_drive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/base/core/names.h"
#include "doppel/lab/headless_run/headless_run.h"
#include "doppel/scenario/schema/robot_names.h"

namespace doppel {
namespace {

constexpr double kPeriod = 0.05;  // s, of commands, below every usual time-out
constexpr double kStopTime = 2.0;

// `now` is the same angle as `before` or less than half a turn from it.
double unwrapped(double now, double before) {
  return before + std::remainder(now - before, 2 * std::numbers::pi);
}

bool takes_part(const std::vector<EndpointInfo>& endpoints, const std::string& node) {
  return std::ranges::any_of(endpoints, [&node](const EndpointInfo& e) { return e.node == node; });
}

}  // namespace

BaseDrive::BaseDrive(const Scenario& scenario, const std::string& controller, Diagnostics& diagnostics)
    : twin_(std::make_unique<Twin>(scenario, log_, diagnostics)) {
  node_ = std::make_unique<Node>(twin_->bus(), "/doppel_base_report");
  find_topics(controller);
  if (topics_.stamped) {
    stamped_ = node_->advertise<geometry_msgs::msg::TwistStamped>(topics_.command);
  } else {
    plain_ = node_->advertise<geometry_msgs::msg::Twist>(topics_.command);
  }
  node_->subscribe<nav_msgs::msg::Odometry>(topics_.odometry, [this](const nav_msgs::msg::Odometry& odom) {
    const auto& q = odom.pose.pose.orientation;
    odometry_ = {odom.pose.pose.position.x, odom.pose.pose.position.y,
                 unwrapped(2 * std::atan2(q.z, q.w), odometry_.heading)};
  });
}

void BaseDrive::find_topics(const std::string& controller) {
  const TwinRobot& robot = twin_->robot();
  std::vector<BaseTopics> found;
  for (const ControllerView& view : robot.controller_manager().controllers()) {
    BaseTopics topics;
    topics.controller = view.name;
    topics.type = view.type;
    const std::string node = in_namespace(robot.name_space(), view.name);
    for (const TopicInfo& topic : twin_->bus().topics()) {
      const bool stamped = topic.type == geometry_msgs::msg::TwistStamped::kType;
      if ((stamped || topic.type == geometry_msgs::msg::Twist::kType) &&
          takes_part(topic.subscribers, node)) {
        topics.command = topic.name;
        topics.stamped = stamped;
      }
      if (topic.type == nav_msgs::msg::Odometry::kType && takes_part(topic.publishers, node))
        topics.odometry = topic.name;
    }
    if (!topics.command.empty() && !topics.odometry.empty()) found.push_back(std::move(topics));
  }
  std::vector<std::string> names;
  for (const BaseTopics& topics : found) names.push_back(topics.controller);
  if (found.empty()) {
    throw InputError(
        "base.no_controller", {},
        fmt::format("{} has no controller of a base: none reads a Twist and publishes odometry",
                    robot.name()),
        "name its controllers' file with --controllers FILE, or add a diff_drive_controller to it "
        "(doppel man bases.md)");
  }
  const auto chosen = controller.empty()
                          ? found.begin()
                          : found.begin() + (std::ranges::find(names, controller) - names.begin());
  if (chosen == found.end()) {
    throw InputError(
        "base.unknown_controller", {},
        fmt::format("no controller of a base is named '{}'{}", controller, did_you_mean(controller, names)),
        fmt::format("choose one of: {}", fmt::join(names, ", ")));
  }
  topics_ = *chosen;
}

void BaseDrive::watch_wheels(std::vector<std::string> left, std::vector<std::string> right, double radius) {
  left_ = std::move(left);
  right_ = std::move(right);
  radius_ = radius;
}

// The mean over the wheels of one side, m.
double BaseDrive::way(const std::vector<std::string>& wheels) const {
  double out = 0.0;
  for (const JointSnapshot& joint : twin_->robot().joints()) {
    if (std::ranges::find(wheels, joint.name) != wheels.end()) out += joint.q;
  }
  return wheels.empty() ? 0.0 : out * radius_ / static_cast<double>(wheels.size());
}

void BaseDrive::observe() {
  const Pose X = twin_->robot().instance().base_pose();
  truth_ = {X.translation().x(), X.translation().y(),
            unwrapped(std::atan2(X.linear()(1, 0), X.linear()(0, 0)), truth_.heading)};
}

PlanarPose BaseDrive::relative(const PlanarPose& pose, const PlanarPose& start) {
  const double x = pose.x - start.x, y = pose.y - start.y;
  const double c = std::cos(start.heading), s = std::sin(start.heading);
  return {c * x + s * y, -s * x + c * y, pose.heading - start.heading};
}

void BaseDrive::drive(double seconds, double v, double w) {
  const auto periods = static_cast<int>(std::lround(seconds / kPeriod));
  for (int i = 0; i < periods && !diverged(); ++i) {
    geometry_msgs::msg::TwistStamped command;
    command.twist.linear.x = v;
    command.twist.angular.z = w;
    if (topics_.stamped) {
      stamped_.publish(command, twin_->now());
    } else {
      plain_.publish(command.twist, twin_->now());
    }
    const RunResult run = run_headless(*twin_, {.duration = from_seconds(kPeriod)});
    run.throw_if_failed();
    if (run.end == RunEnd::diverged) return;
    observe();
    leg_.path.push_back(truth());
    leg_.path_odometry.push_back(odometry());
    if (!left_.empty())
      leg_.rolled.push_back({way(left_) - rolled_start_[0], way(right_) - rolled_start_[1]});
  }
}

void BaseDrive::stop() {
  drive(kStopTime, 0, 0);
}

void BaseDrive::begin_leg() {
  observe();
  truth_start_ = truth_;
  odometry_start_ = odometry_;
  rolled_start_ = {way(left_), way(right_)};
  leg_ = {};
}

BaseLeg BaseDrive::end_leg() {
  BaseLeg out = std::move(leg_);
  out.truth = truth();
  out.odometry = odometry();
  return out;
}

}  // namespace doppel
