#pragma once
// An arm of a twin that moves along courses of its joints, and the pose of its tool with the errors of its
// servos.

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/validation/extras/detail/extra_arm.h"
#include "doppel/validation/extras/detail/joint_motion.h"
#include "doppel/validation/extras/detail/servo_errors.h"

namespace doppel {

inline constexpr double kCommandStep = 0.01;  // s between points of a trajectory

// The share of a way with the least jerk at a share of its time, both 0 to 1; its largest speed is
// kPeakOfQuintic times the mean one.
[[nodiscard]] double quintic(double share);
inline constexpr double kPeakOfQuintic = 1.875;

class ArmMotion {
 public:
  // With the suite's payload. The arm outlives it.
  ArmMotion(const CheckContext& context, const ExtraArm& arm);

  // The arm holds q [nq] at rest. A string: why it does not.
  [[nodiscard]] std::string begin(const Eigen::VectorXd& q);
  // A course of the arm's variables, as JointMotion::run. after_step() gets the time since its begin, and is
  // not called before it; every_step() is.
  [[nodiscard]] bool run(const JointMotion::Course& course, double seconds, double rest,
                         const std::function<void(double)>& after_step,
                         const std::function<void()>& every_step = {});
  // s: the least time from u to u [variables], at least 0.4 s, in which no joint is faster than `part` of its
  // speed limit.
  [[nodiscard]] double motion_time(const Eigen::VectorXd& start, const Eigen::VectorXd& end,
                                   double part) const;
  [[nodiscard]] static JointMotion::Course straight(Eigen::VectorXd start, Eigen::VectorXd end, double time);

  [[nodiscard]] Pose tool();       // of the tip in the root link, as the engine has it
  [[nodiscard]] Pose real_tool();  // with the servos' errors
  // After each of these the errors are others.
  void begin_run() { errors_.begin(++runs_); }

  [[nodiscard]] MachineRun& machine() { return machine_; }
  [[nodiscard]] const std::vector<int>& joints() const { return joints_; }  // of the twin, by variable
  [[nodiscard]] const ServoErrors& errors() const { return errors_; }

 private:
  [[nodiscard]] Eigen::VectorXd variables() const;
  void follow_play();

  const ExtraArm& arm_;
  MachineRun machine_;
  std::vector<std::string> names_;
  std::vector<int> joints_;
  JointMotion motion_;
  ServoErrors errors_;
  std::uint64_t runs_ = 0;
  Eigen::VectorXd friction_, q_;
  Data data_;
  int base_ = 0, tip_ = 0;
  double next_play_ = 0;  // s
};

}  // namespace doppel
