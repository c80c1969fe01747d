#include "doppel/robot/kinematics/detail/assumed_masses.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/kinematics/link_inertia.h"
#include "doppel/robot/kinematics/link_solid.h"

namespace doppel {
namespace {

constexpr double kThickness = 0.3;       // of a bar's length
constexpr double kMinLengthRatio = 0.1;  // of the longest bar
constexpr double kHeld = 0.5;            // of a drive's effort that gravity may load
constexpr double kMinScale = 1e-4;
constexpr std::size_t kNamesShown = 8;
const Eigen::Vector3d kGravity{0, 0, -9.81};  // m/s^2, in the root link's axes

// A bar from the origin to `end`, m.
MassProperties bar(const Eigen::Vector3d& end) {
  const double length = end.norm();
  Pose X = Pose::Identity();
  X.linear() = rotation_from_z(end);
  X.translation() = 0.5 * end;
  return transformed(solid_cylinder(0.5 * kThickness * length, length), X);
}

class MassEstimator {
 public:
  MassEstimator(Model& model, const std::vector<const Link*>& sources) : model_(model), sources_(sources) {
    const std::size_t links = model.links.size();
    body_.assign(links, 0);
    X_BL_.assign(links, Pose::Identity());
    mass_.assign(links, 0.0);
    reach_.assign(links, Eigen::Vector3d::Zero());
    for (std::size_t i = 0; i < links; ++i) {
      const int index = model.links[i].joint;
      if (index >= 0) {
        const ModelJoint& joint = model.joints[static_cast<std::size_t>(index)];
        const auto parent = static_cast<std::size_t>(joint.parent_link);
        const Pose X_BJ = X_BL_[parent] * joint.X_PJ;
        Eigen::Vector3d& reach = reach_[body_[parent]];
        if (X_BJ.translation().norm() > reach.norm()) reach = X_BJ.translation();
        const bool welded = joint.type == JointType::fixed;
        body_[i] = welded ? body_[parent] : i;
        if (welded) X_BL_[i] = X_BJ;
      }
      if (model.links[i].inertia) mass_[body_[i]] += model.links[i].inertia->mass;
    }
  }

  // The topmost links of movable bodies without mass.
  [[nodiscard]] std::vector<std::size_t> massless() const {
    std::vector<std::size_t> out;
    for (std::size_t i = 1; i < body_.size(); ++i) {
      if (body_[i] == i && !(mass_[i] > 0)) out.push_back(i);
    }
    return out;
  }

  [[nodiscard]] bool any_written() const {
    for (std::size_t i = 1; i < body_.size(); ++i) {
      if (body_[i] == i && mass_[i] > 0) return true;
    }
    return false;
  }

  [[nodiscard]] MassProperties by_shapes(std::size_t body) const {
    MassProperties sum;
    for (std::size_t i = 0; i < body_.size(); ++i) {
      if (body_[i] != body || sources_[i] == nullptr) continue;
      const MassProperties part = link_solid(*sources_[i]);
      if (part.mass > 0) sum = combined(sum, transformed(part, X_BL_[i]));
    }
    return sum;
  }

  [[nodiscard]] MassProperties by_length(std::size_t body) const {
    Eigen::Vector3d end = reach_of(body);
    double longest = 0.0;
    for (std::size_t i = 1; i < body_.size(); ++i) longest = std::max(longest, reach_of(i).norm());
    const double least = longest > 0 ? kMinLengthRatio * longest : 0.02;
    if (end.norm() < least)
      end = least * (end.norm() > 1e-9 ? end.normalized().eval() : Eigen::Vector3d::UnitZ().eval());
    return bar(end);
  }

 private:
  [[nodiscard]] Eigen::Vector3d reach_of(std::size_t body) const {
    const int joint = model_.links[body].joint;
    const Pose& X_PJ = model_.joints[static_cast<std::size_t>(joint)].X_PJ;
    const Eigen::Vector3d own = 0.5 * (X_PJ.linear().transpose() * X_PJ.translation());
    return reach_[body].norm() >= own.norm() ? reach_[body] : own;
  }

  const Model& model_;
  const std::vector<const Link*>& sources_;
  std::vector<std::size_t> body_;       // [links] the topmost link of the body
  std::vector<Pose> X_BL_;              // [links] link in its body's topmost link
  std::vector<double> mass_;            // [links] kg, of bodies
  std::vector<Eigen::Vector3d> reach_;  // [links] from a body's joint to the farthest that it carries, m
};

// The factor for all masses with which every drive holds its load; `weakest` is the joint that determines it.
double scale_to_drives(const Model& model, std::string& weakest) {
  Data data(model);
  Eigen::VectorXd torques;
  double scale = 1.0;
  for (const Eigen::VectorXd& q : sample_configurations(model, kConfigurationSamples)) {
    gravity_torques(model, data, q, kGravity);
    drive_torques(model, data, torques);
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      const ModelJoint& joint = model.joints[j];
      const double load = std::abs(torques[static_cast<Eigen::Index>(j)]);
      if (!joint.scalar() || joint.mimics() || load * scale <= kHeld * joint.effort) continue;
      scale = kHeld * joint.effort / load;
      weakest = joint.name;
    }
  }
  return std::max(scale, kMinScale);
}

}  // namespace

void assume_masses(Model& model, const std::vector<const Link*>& sources, Diagnostics& diagnostics) {
  const MassEstimator estimator(model, sources);
  const std::vector<std::size_t> bodies = estimator.massless();
  if (bodies.empty()) return;
  std::size_t by_length = 0;
  for (const std::size_t body : bodies) {
    MassProperties assumed = estimator.by_shapes(body);
    if (!(assumed.mass > kMinSolidMass)) {
      assumed = estimator.by_length(body);
      ++by_length;
    }
    if (!physical_defect(assumed).empty()) assumed = physical_repair(assumed);
    // The sum over turned shapes may differ from its transpose in the last digit; a file has six numbers.
    assumed.I = Eigen::Matrix3d(assumed.I.selfadjointView<Eigen::Upper>());
    model.links[body].inertia = assumed;
  }
  std::string weakest;
  const double scale = estimator.any_written() ? 1.0 : scale_to_drives(model, weakest);
  std::string names;
  double total = 0.0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    MassProperties& body = *model.links[bodies[i]].inertia;
    body.mass *= scale;
    body.I *= scale;
    total += body.mass;
    if (i < kNamesShown)
      names += fmt::format("{}'{}' {:.2g} kg", i == 0 ? "" : ", ", model.links[bodies[i]].name, body.mass);
  }
  if (bodies.size() > kNamesShown) names += fmt::format(" and {} more", bodies.size() - kNamesShown);
  const bool one = bodies.size() == 1;
  const char* const from = by_length == 0 ? (one ? "its shapes" : "their shapes")
                           : one          ? "its length"
                           : by_length == bodies.size()
                               ? "the distances between their joints"
                               : "their shapes, or the distances between their joints";
  const Link* const first = sources[bodies.front()];
  diagnostics.warning("model.no_inertial", first != nullptr ? first->source : SourceLocation{},
                      fmt::format("{}; estimated from {}{}: {}{}",
                                  one ? "a movable link has no mass"
                                      : fmt::format("{} movable links have no mass", bodies.size()),
                                  from,
                                  scale < 1.0 ? fmt::format(", scaled by {:.2g} so that '{}' holds {}", scale,
                                                            weakest, one ? "it" : "them")
                                              : "",
                                  names, one ? "" : fmt::format("; {:.3g} kg together", total)),
                      fmt::format("write <inertial> with the mass, centre of mass and inertia tensor of {}; "
                                  "loads and motion are only as accurate as {}",
                                  one ? "the link" : "each link", one ? "this" : "these"));
}

}  // namespace doppel
