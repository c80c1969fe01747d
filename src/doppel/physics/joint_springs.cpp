#include "doppel/physics/joint_springs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/kinematics/dynamics.h"
#include "doppel/physics/step_scheme.h"

namespace doppel {

std::vector<Drive> make_drives(const ModelInstance& instance, const WorldSettings& settings) {
  const Model& model = *instance.model;
  const bool ideal = std::ranges::any_of(instance.servos, &ServoParameters::ideal);
  if (ideal && step_scheme(settings.integrator).order > 1) {
    throw InputError(
        "physics.ideal_scheme", {},
        fmt::format("ideal servos land on their reference within one step of euler; {} is no such "
                    "integrator",
                    name_of(settings.integrator)),
        "leave `integrator` out of the world, or the servos as they are");
  }
  const Eigen::VectorXd carried =
      ideal ? carried_inertia(model)
            : Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joints.size())).eval();
  std::vector<Drive> out;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    if (joint.scalar() && !joint.mimics())
      out.emplace_back(static_cast<int>(i), instance.servos[i], carried[static_cast<Eigen::Index>(i)],
                       settings.step);
  }
  return out;
}

JointSpring spring_of_joint(const Model& model, int joint) {
  JointSpring spring;
  spring.joint = joint;
  spring.q = model.joints[static_cast<std::size_t>(joint)].q;
  spring.v = model.joints[static_cast<std::size_t>(joint)].v;
  return spring;
}

std::vector<JointSpring> make_stops(const Model& model) {
  std::vector<JointSpring> out;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    if (!joint.scalar() || !(joint.stop_stiffness > 0)) continue;
    JointSpring stop = spring_of_joint(model, static_cast<int>(i));
    stop.stiffness = joint.stop_stiffness;
    stop.reference = joint.lower;
    stop.low = 0.0;
    if (std::isfinite(joint.lower)) out.push_back(stop);
    stop.reference = joint.upper;
    stop.low = -kInfinity;
    stop.high = 0.0;
    if (std::isfinite(joint.upper)) out.push_back(stop);
  }
  return out;
}

}  // namespace doppel
