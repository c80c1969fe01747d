#pragma once
// The linear model of drives that hold positions, at one configuration.

#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "doppel/validation/checks/context.h"

namespace doppel {

// (M s^2 + (B + D) s + K) q = (K + D s) r: inertia M of the joints whose drives hold a position, mimics
// included, damping B of the joints, springs K and dampers D of the drives (physics/contract/servo.h).
// Gravity, friction and effort limits are not part of it; joints without such a drive do not move.
class ServoResponse {
 public:
  ServoResponse(const Subject& subject, const Eigen::VectorXd& q);
  [[nodiscard]] bool has(const std::string& joint) const { return index_of(joint) >= 0; }
  // Position by command of the same joint, at a frequency in Hz. `period`: of the commands, s, between which
  // the drive moves evenly; 0: they are continuous. Precondition: has().
  [[nodiscard]] std::complex<double> at_frequency(const std::string& joint, double frequency,
                                                  double period) const;

 private:
  [[nodiscard]] Eigen::Index index_of(const std::string& joint) const;

  std::vector<std::string> joints_;
  Eigen::MatrixXd M_;
  Eigen::VectorXd K_, D_, B_;
};

}  // namespace doppel
