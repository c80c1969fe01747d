#include "doppel/validation/extras/detail/servo_response.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/robot/kinematics/dynamics.h"

namespace doppel {

ServoResponse::ServoResponse(const Subject& subject, const Eigen::VectorXd& q) {
  const Model& model = *subject.model;
  const Model& twin = subject.robot().model();
  std::vector<int> indices;
  std::vector<double> springs, dampers;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    const int index = twin.find_joint(joint.name);
    if (!joint.scalar() || joint.mimics() || index < 0) continue;
    const ServoParameters& servo = subject.robot().servos()[static_cast<std::size_t>(index)];
    if (servo.ideal || !(servo.stiffness > 0)) continue;
    joints_.push_back(joint.name);
    indices.push_back(static_cast<int>(i));
    springs.push_back(servo.stiffness);
    dampers.push_back(servo.damping);
  }
  const auto count = static_cast<Eigen::Index>(joints_.size());
  K_ = Eigen::VectorXd::Map(springs.data(), count);
  D_ = Eigen::VectorXd::Map(dampers.data(), count);
  B_ = Eigen::VectorXd::Zero(count);
  Eigen::MatrixXd coupling = Eigen::MatrixXd::Zero(model.nv, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    for (std::size_t i = 0; i < model.joints.size(); ++i) {
      const ModelJoint& joint = model.joints[i];
      const int leader = indices[static_cast<std::size_t>(k)];
      const double rate = static_cast<int>(i) == leader                    ? 1
                          : joint.scalar() && joint.mimic_leader == leader ? joint.mimic_multiplier
                                                                           : 0;
      if (rate == 0) continue;
      coupling(joint.v, k) = rate;
      B_[k] += rate * rate * joint.damping;
    }
  }
  Data data(model);
  mass_matrix(model, data, q);
  M_ = coupling.transpose() * data.M * coupling;
}

Eigen::Index ServoResponse::index_of(const std::string& joint) const {
  const auto found = std::ranges::find(joints_, joint);
  return found == joints_.end() ? -1 : found - joints_.begin();
}

std::complex<double> ServoResponse::at_frequency(const std::string& joint, double frequency,
                                                 double period) const {
  const std::complex<double> s(0, 2 * std::numbers::pi * frequency);
  const Eigen::Index k = index_of(joint);
  Eigen::MatrixXcd A = M_.cast<std::complex<double>>() * (s * s);
  A.diagonal() += (B_ + D_).cast<std::complex<double>>() * s + K_.cast<std::complex<double>>();
  Eigen::VectorXcd drive = Eigen::VectorXcd::Zero(K_.size());
  drive[k] = K_[k] + D_[k] * s;
  const double angle = std::numbers::pi * frequency * period;
  const double share = angle > 0 ? std::sin(angle) / angle : 1;
  return share * share * A.partialPivLu().solve(drive)[k];
}

}  // namespace doppel
