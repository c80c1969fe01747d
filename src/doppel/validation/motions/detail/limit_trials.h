#pragma once
// Commands beyond the limits of a joint, and what they do to it.

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/validation/motions/machine_run.h"

namespace doppel {

enum class LimitTrial { above, below, fast, effort, not_a_number, infinite, jump };
inline constexpr std::array<std::string_view, 7> kLimitTrialNames = {"beyond the upper limit",
                                                                     "beyond the lower limit",
                                                                     "at twice the speed limit",
                                                                     "twice the effort limit",
                                                                     "NaN",
                                                                     "infinity",
                                                                     "a jump across the range"};

inline constexpr double kPositionRoom = 2e-3, kSlideRoom = 2e-4;  // rad, m: that are no violation
inline constexpr double kSpeedRoom = 1.02;                        // of the limit
inline constexpr double kSpeedWindow = 0.2;                       // s, over which a speed is a mean

// The largest that a trial did to its joint.
struct Reaction {
  double beyond = 0;                                  // rad or m beyond a position limit
  double command_beyond = 0;                          // the same of the drive's target
  double speed = 0, momentary_speed = 0, effort = 0;  // of the limits
  bool finite = true, diverged = false, answered = false;
  double command = 0;  // the drive's target that is farthest beyond the limits

  [[nodiscard]] bool violates(bool slides) const;
};

// One trial of one joint, from the state that the machine has.
class LimitTrialRun {
 public:
  // `seconds`: of simulated time, at most.
  LimitTrialRun(MachineRun& machine, int joint, double seconds)
      : machine_(machine), joint_(joint), about_(machine.joint(joint)), seconds_(seconds) {}

  // Ends early where the command is over and the joint rests, so that nothing more happens.
  Reaction run(const JointWay& way, LimitTrial trial);
  // Ends at the first violation.
  Reaction run_to_violation(const JointWay& way, LimitTrial trial);
  // The same motion to the limit and no farther.
  Reaction legal(const JointWay& way, LimitTrial trial);

  // True if the trial means something for this joint and way.
  [[nodiscard]] bool applies(const JointWay& way, LimitTrial trial) const;
  // The position from which the trial begins.
  [[nodiscard]] double start(LimitTrial trial) const;
  // The farthest position of the joint in the trial, if limits are enforced.
  [[nodiscard]] double end(LimitTrial trial) const;

 private:
  Reaction carry_out(const JointWay& way, double value, double seconds, bool to_violation);
  // The value of a command, and the seconds in which a trajectory gets there.
  [[nodiscard]] std::pair<double, double> command(const JointWay& way, LimitTrial trial) const;
  void observe(const JointWay& way, Reaction& out);
  [[nodiscard]] bool is_over(const JointWay& way, double command_seconds) const;

  MachineRun& machine_;
  int joint_;
  const ModelJoint& about_;
  double seconds_;
  std::vector<double> past_;  // positions
  double elapsed_ = 0, quiet_since_ = 0, target_ = 0;
};

}  // namespace doppel
