#pragma once
// Robots of the benchmarks of inverse kinematics, reachable poses of their arms by the protocol of TRAC-IK
// (Beeson and Ames, Humanoids 2015), and the judge of solutions.

#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/load.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/robot/reach/arm_group.h"

namespace doppel::bench {

// A robot as the command line names it: a bundled one or a file, the ends of a chain, and the file's
// arguments.
struct RobotWord {
  std::string robot, base, tip;  // base and tip: empty, or both
  XacroArguments arguments;

  [[nodiscard]] std::string shown() const;
};

// "NAME", "FILE" or "FILE:BASE:TIP", and name:=value for the robot before it.
std::vector<RobotWord> parse_robots(const std::vector<std::string>& words);

struct BenchRobot {
  RobotDescription description;
  std::shared_ptr<const Model> model;
  std::vector<ArmGroup> arms;
  int groups = 0;      // that are no grippers
  Diagnostics no_arm;  // why a group is no arm
};

// As `doppel ik` opens a robot. Throws InputError.
BenchRobot open_robot(const RobotWord& word);

struct ReachTargets {
  std::vector<Pose> X_BT;
};

// Poses of configurations that are evenly distributed within the limits; joints without limits cover a turn.
ReachTargets reachable_targets(const Model& model, const Chain& chain, int count);

inline constexpr double kJudged = 1e-5;  // m, rad

// It judges by the forward kinematics of the whole model.
class IkJudge {
 public:
  IkJudge(const Model& model, const Chain& chain, double tolerance = kJudged);

  // True: the tip of u [variables] is in the pose, and u is within the limits.
  [[nodiscard]] bool right(const Eigen::VectorXd& u, const Pose& X_BT);
  // The same, after whole turns that bring joints into their limits.
  [[nodiscard]] bool right_by_turns(Eigen::VectorXd& u, const Pose& X_BT);

 private:
  const Model& model_;
  const Chain& chain_;
  double tolerance_;
  Data data_;
  Eigen::VectorXd q_;
};

// us: the processor's time of this thread, and time on the clock.
double thread_us();
double clock_us();

// The value that a part of the sorted `values` does not exceed; 0 without values.
double quantile(std::vector<double>& values, double part);

}  // namespace doppel::bench
