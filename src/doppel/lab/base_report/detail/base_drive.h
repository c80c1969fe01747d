#pragma once
// Private to this module: a twin whose base is commanded through the topic of its controller, with the true
// pose and the odometry's.

#include <memory>
#include <string>
#include <vector>

#include "doppel/lab/base_report/base_report.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/nav_msgs.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {

// The controller of a base and its topics.
struct BaseTopics {
  std::string controller, type, command, odometry;
  bool stamped = true;
};

class BaseDrive {
 public:
  // Throws InputError.
  BaseDrive(const Scenario& scenario, const std::string& controller, Diagnostics& diagnostics);

  [[nodiscard]] Twin& twin() { return *twin_; }
  [[nodiscard]] const BaseTopics& topics() const { return topics_; }
  // The wheels of both sides, whose mean rolls; for the ways of BaseLeg::rolled.
  void watch_wheels(std::vector<std::string> left, std::vector<std::string> right, double radius);

  // Commands a velocity (m/s, rad/s) for a time (s) at 20 Hz, and records the leg. Ends when the physics
  // diverges.
  void drive(double seconds, double v, double w);
  [[nodiscard]] bool diverged() const { return twin_->diverged(); }
  void stop();
  void begin_leg();
  [[nodiscard]] BaseLeg end_leg();

  // Since begin_leg, in its axes.
  [[nodiscard]] PlanarPose truth() const { return relative(truth_, truth_start_); }
  [[nodiscard]] PlanarPose odometry() const { return relative(odometry_, odometry_start_); }

 private:
  static PlanarPose relative(const PlanarPose& pose, const PlanarPose& start);
  void find_topics(const std::string& controller);
  void observe();
  [[nodiscard]] double way(const std::vector<std::string>& wheels) const;

  Log log_;
  std::unique_ptr<Twin> twin_;
  std::unique_ptr<Node> node_;
  BaseTopics topics_;
  Publisher<geometry_msgs::msg::TwistStamped> stamped_;
  Publisher<geometry_msgs::msg::Twist> plain_;
  std::vector<std::string> left_, right_;
  double radius_ = 0;
  PlanarPose truth_, odometry_, truth_start_, odometry_start_;
  std::array<double, 2> rolled_start_ = {0, 0};
  BaseLeg leg_;
};

}  // namespace doppel
