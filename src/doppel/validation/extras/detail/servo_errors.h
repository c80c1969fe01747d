#pragma once
// An engine's drives are ideal. A servo also has a position sensor with steps and noise, and gears with play.
// This is a model of where a joint is when its drive believes it is somewhere else; it acts on no force.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "doppel/review/audit/drive_precision.h"
#include "doppel/sensors/models/counter_random.h"
#include "doppel/validation/extras/detail/extra_arm.h"

namespace doppel {

class ServoErrors {
 public:
  ServoErrors(std::vector<DrivePrecision> drives, std::uint64_t seed);
  // The errors of an arm's variables, by the datasheet.
  ServoErrors(const CheckContext& context, const ExtraArm& arm);

  [[nodiscard]] bool any() const { return any_; }
  // "STS3215 (resolution 0.0879 deg, backlash 0.5 deg)".
  [[nodiscard]] std::string text() const;

  // Another approach of a pose, or another passage of a path: where the steps lie against the command, and
  // where the noise has left the joint, are drawn anew.
  void begin(std::uint64_t run);
  // Takes the joints' play along: `u` [variables], where the drives are now; `loads` [variables], what the
  // drives hold, N m or N. A joint with more load than `friction` lies on the side to which it is pulled; any
  // other follows its drive at the end of the play.
  void follow(const Eigen::VectorXd& u, const Eigen::VectorXd& loads, const Eigen::VectorXd& friction);
  // The joints while the drives are at u [variables] are at
  //   u + step (frac((u + phase) / step) - 1/2) + noise + play
  // The error of a step is that of a joint that rests anywhere within it, uniform in +-step/2.
  [[nodiscard]] Eigen::VectorXd apply(const Eigen::VectorXd& u) const;

 private:
  std::vector<DrivePrecision> drives_;
  bool any_ = false;
  CounterRandom random_;
  Eigen::VectorXd phase_, noise_, play_, before_;
};

}  // namespace doppel
