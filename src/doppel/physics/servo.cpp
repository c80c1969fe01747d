#include "doppel/physics/servo.h"

#include <algorithm>
#include <cmath>

#include "doppel/kinematics/dynamics.h"

namespace doppel {
namespace {

// Largest torque [joints] that gravity asks of each drive over the sampled configurations.
Eigen::VectorXd largest_gravity(const Model& model, const Eigen::Vector3d& gravity) {
  Data data(model);
  Eigen::VectorXd torques;
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joints.size()));
  for (const Eigen::VectorXd& q : sample_configurations(model, kConfigurationSamples)) {
    gravity_torques(model, data, q, gravity);
    drive_torques(model, data, torques);
    largest = largest.cwiseMax(torques.cwiseAbs());
  }
  return largest;
}

}  // namespace

std::vector<ServoParameters> choose_servos(const Model& model, const ServoOptions& options,
                                           const Eigen::Vector3d& gravity) {
  const Eigen::VectorXd inertia = carried_inertia(model);
  const Eigen::VectorXd load = largest_gravity(model, gravity);
  std::vector<ServoParameters> servos(model.joints.size());
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    if (!joint.scalar() || joint.mimics()) continue;
    const auto at = static_cast<Eigen::Index>(i);
    const bool slides = joint.type == JointType::prismatic;
    const double held = std::min(load[at] + joint.friction, joint.effort);
    ServoParameters& servo = servos[i];
    const double whole_effort = std::min(joint.effort / (slides ? kFullEffortSlideError : kFullEffortError),
                                         inertia[at] * kStiffestFrequency * kStiffestFrequency);
    servo.stiffness = std::max({inertia[at] * options.natural_frequency * options.natural_frequency,
                                held / (slides ? kLargestSlideSag : kLargestSag), whole_effort});
    servo.damping = 2.0 * options.damping_ratio * std::sqrt(servo.stiffness * inertia[at]);
    servo.effort = joint.effort;
    servo.velocity = joint.velocity;
    servo.ideal = options.ideal;
  }
  return servos;
}

void static_sag(const Model& model, Data& data, const std::vector<ServoParameters>& servos,
                const ConstVector& q, const Eigen::Vector3d& gravity, StaticSag& out) {
  gravity_torques(model, data, q, gravity);
  drive_torques(model, data, out.torques);
  out.sags.clear();
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    if (!joint.scalar() || joint.mimics()) continue;
    const ServoParameters& servo = servos[i];
    Sag sag;
    sag.joint = static_cast<int>(i);
    sag.torque = out.torques[sag.joint];
    sag.sag = servo.ideal || !(servo.stiffness > 0) ? 0.0 : sag.torque / servo.stiffness;
    sag.margin = servo.effort - std::abs(sag.torque);
    out.sags.push_back(sag);
  }
}

}  // namespace doppel
