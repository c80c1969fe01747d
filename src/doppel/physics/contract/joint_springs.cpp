#include "doppel/physics/contract/detail/joint_springs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/physics/contract/detail/limit_stop.h"
#include "doppel/physics/contract/step_scheme.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel {
namespace {

// Passes in which all springs on the wrong side change at once, and further passes per spring in which a
// single one does; in later passes springs are only set to a bound, never released, so that the passes end.
constexpr int kFreePasses = 4, kSinglePasses = 4;
// Largest (step * natural frequency)^2 of a stop at which a step resolves its rebound.
constexpr double kResolved = 0.1;

}  // namespace

std::vector<Drive> make_drives(const ModelInstance& instance, const WorldSettings& settings) {
  const Model& model = *instance.model;
  const bool ideal = std::ranges::any_of(instance.servos, &ServoParameters::ideal);
  if (ideal && step_scheme(settings.integrator).order > 1) {
    throw InputError("physics.ideal_scheme", {},
                     fmt::format("ideal servos need the integrator euler, with which they reach their "
                                 "reference in one step; the integrator is {}",
                                 name_of(settings.integrator)),
                     "remove `integrator` from the world, or do not use ideal servos");
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

bool meet_stop(JointSpring& stop, double q) {
  const double beyond = stop.low < 0 ? q - stop.reference : stop.reference - q;
  const bool was_on = stop.on;
  stop.on = beyond > 0;
  return stop.on && !was_on;
}

void hit_stop(JointSpring& stop, double restitution, double inertia, double h) {
  const double ratio = damping_ratio_of(restitution);
  stop.bound = 0;
  stop.damping = 2.0 * ratio * std::sqrt(stop.stiffness * inertia);
  // Stiffer than the step resolves: the depth is up to speed * step, and the explicit spring of the next step
  // returns a speed of at most stiffness * depth / damping.
  if (stop.stiffness * h * h > kResolved * inertia)
    stop.damping = std::max(stop.damping, stop.stiffness * h / restitution_of(ratio));
}

bool rebound(std::span<JointSpring> springs, std::span<const double> asked, int pass) {
  const bool one_only = pass >= kFreePasses;
  const bool binds_only = pass >= kFreePasses + kSinglePasses * static_cast<int>(springs.size());
  bool changed = false;
  for (std::size_t k = 0; k < springs.size(); ++k) {
    JointSpring& spring = springs[k];
    if (!spring.on) continue;
    const int bound = bound_of(spring, asked[k]);
    if (bound == spring.bound || (binds_only && spring.bound != 0)) continue;
    spring.bound = one_only && spring.bound != 0 ? 0 : bound;  // not from one bound to the other
    changed = true;
    if (one_only) break;
  }
  return changed;
}

}  // namespace doppel
