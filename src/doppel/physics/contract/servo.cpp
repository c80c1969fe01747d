#include "doppel/physics/contract/servo.h"

#include <algorithm>
#include <cmath>

#include "doppel/robot/kinematics/dynamics.h"

namespace doppel {
namespace {

// Largest load of gravity on each drive over the sampled configurations, [joints] N m or N.
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

// Load on a joint whose link stands on the ground: the rest of a robot with a floating root, about the
// joint's axis at the neutral pose. Zero for joints whose subtree has no link near the ground.
struct Standing {
  Eigen::VectorXd inertia;  // [joints] kg m^2 or kg
  Eigen::VectorXd load;     // [joints] N m or N: weight times the whole lever, as if it were horizontal
};

constexpr double kNearGround = 0.15;  // of the robot's height above its lowest link

Standing standing_loads(const Model& model, const Eigen::Vector3d& gravity) {
  const auto joints = static_cast<Eigen::Index>(model.joints.size());
  Standing out{Eigen::VectorXd::Zero(joints), Eigen::VectorXd::Zero(joints)};
  if (model.joints.empty() || model.joints.front().type != JointType::floating || !(gravity.norm() > 0))
    return out;
  Data data(model);
  forward_kinematics(model, data, model.neutral());
  const Eigen::Vector3d up = -gravity.normalized();
  std::vector<MassProperties> bodies(model.links.size());  // in the root's frame
  double lowest = kInfinity, highest = -kInfinity;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!model.links[i].inertia) continue;
    bodies[i] = transformed(*model.links[i].inertia, data.X_WL[i]);
    lowest = std::min(lowest, up.dot(bodies[i].com));
    highest = std::max(highest, up.dot(bodies[i].com));
  }
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const ModelJoint& joint = model.joints[j];
    if (!joint.scalar()) continue;
    std::vector<bool> below(model.links.size(), false);
    MassProperties rest;
    bool stands = false;
    for (std::size_t i = 0; i < model.links.size(); ++i) {
      const int parent = model.links[i].joint < 0
                             ? -1
                             : model.joints[static_cast<std::size_t>(model.links[i].joint)].parent_link;
      below[i] =
          static_cast<int>(i) == joint.child_link || (parent >= 0 && below[static_cast<std::size_t>(parent)]);
      if (!(bodies[i].mass > 0)) continue;
      if (!below[i]) rest = combined(rest, bodies[i]);
      stands = stands || (below[i] && up.dot(bodies[i].com) < lowest + kNearGround * (highest - lowest));
    }
    if (!stands || !(rest.mass > 0)) continue;
    const auto at = static_cast<Eigen::Index>(j);
    if (joint.type == JointType::prismatic) {
      out.inertia[at] = rest.mass;
      out.load[at] = rest.mass * gravity.norm();
      continue;
    }
    const Pose& X_WC = data.X_WL[static_cast<std::size_t>(joint.child_link)];
    const Eigen::Vector3d axis = X_WC.linear() * joint.axis;
    const double lever = (rest.com - X_WC.translation()).cross(axis).norm();
    out.inertia[at] = axis.dot(rest.I * axis) + rest.mass * lever * lever;
    out.load[at] = rest.mass * gravity.norm() * lever;
  }
  return out;
}

}  // namespace

std::vector<ServoParameters> choose_servos(const Model& model, const ServoOptions& options,
                                           const Eigen::Vector3d& gravity) {
  const Eigen::VectorXd inertia = carried_inertia(model);
  const Standing standing = standing_loads(model, gravity);
  const Eigen::VectorXd load = largest_gravity(model, gravity).cwiseMax(standing.load);
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
                                held / (slides ? kMaxSlideSag : kMaxSag), whole_effort});
    servo.damping = 2.0 * options.damping_ratio *
                    std::sqrt(servo.stiffness * std::max(inertia[at], standing.inertia[at]));
    servo.effort = joint.effort;
    servo.velocity = joint.velocity;
    if (std::isfinite(joint.effort))
      servo.rotor_inertia = std::max(0.0, joint.effort * kMinSpinUp / joint.velocity - inertia[at]);
    servo.ideal = options.ideal;
  }
  return servos;
}

void static_sag(const Model& model, Data& data, const std::vector<ServoParameters>& servos,
                const ConstVector& q, const Eigen::Vector3d& gravity, StaticSag& out) {
  gravity_torques(model, data, q, gravity);
  drive_torques(model, data, out.torques);
  out.frictions.setZero(static_cast<Eigen::Index>(model.joints.size()));
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    const auto carrier = static_cast<Eigen::Index>(joint.mimics() ? joint.mimic_leader : static_cast<int>(i));
    out.frictions[carrier] += (joint.mimics() ? std::abs(joint.mimic_multiplier) : 1.0) * joint.friction;
  }
  out.sags.clear();
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    if (!joint.scalar() || joint.mimics()) continue;
    const ServoParameters& servo = servos[i];
    Sag sag;
    sag.joint = static_cast<int>(i);
    sag.torque = out.torques[sag.joint];
    sag.friction = out.frictions[sag.joint];
    const double near = joint.type == JointType::prismatic ? kOnSlideLimit : kOnLimit;
    sag.on_limit = (sag.torque < 0 && q[joint.q] > joint.upper - near) ||
                   (sag.torque > 0 && q[joint.q] < joint.lower + near);
    if (!sag.on_limit && !servo.ideal && servo.stiffness > 0) {
      sag.sag = sag.torque / servo.stiffness;
      sag.least = (sag.torque - sag.friction) / servo.stiffness;
      sag.most = (sag.torque + sag.friction) / servo.stiffness;
    }
    sag.margin = servo.effort - (sag.on_limit ? 0.0 : std::abs(sag.torque));
    out.sags.push_back(sag);
  }
}

}  // namespace doppel
