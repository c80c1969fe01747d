#include "doppel/physics/engines/mujoco/bounces.h"

#include <Eigen/Core>
#include <algorithm>

#include "doppel/physics/contract/detail/contact_rule.h"

namespace doppel {
namespace {

// Regularisation of a hard row, of the inverse inertia that it sees. MuJoCo's contacts have 0.01 to 0.05,
// which would be missing in the rebound.
constexpr double kSoftness = 1e-4;
// m/s^2: the reference of a contact that must not act.
constexpr double kOpen = -1e9;

Eigen::Map<const Eigen::Vector3d> gravity_of(const mjModel& model) {
  return Eigen::Map<const Eigen::Vector3d>(model.opt.gravity);
}

// The acceleration with which gravity closes a contact of which one body does not move.
double pull_of(const mjModel& model, const mjContact& contact) {
  const double along = gravity_of(model).dot(Eigen::Map<const Eigen::Vector3d>(contact.frame));
  const bool first = model.body_weldid[model.geom_bodyid[contact.geom1]] != 0;
  const bool second = model.body_weldid[model.geom_bodyid[contact.geom2]] != 0;
  return first == second ? 0.0 : std::max(first ? along : -along, 0.0);
}

double min_rebound(const mjModel& model) {
  return min_rebound_speed(gravity_of(model), model.opt.timestep);
}

}  // namespace

Bounces::Bounces(std::vector<std::optional<double>> restitutions) {
  if (std::ranges::any_of(restitutions, [](const auto& e) { return e.has_value(); }))
    restitutions_ = std::move(restitutions);
}

std::optional<double> Bounces::of(const mjContact& contact) const {
  if (contact.efc_address < 0) return std::nullopt;
  return combine(restitutions_[static_cast<std::size_t>(contact.geom1)],
                 restitutions_[static_cast<std::size_t>(contact.geom2)]);
}

bool Bounces::impacts(const mjModel& model, const mjData& data) const {
  if (empty()) return false;
  return std::any_of(data.contact, data.contact + data.ncon, [&](const mjContact& contact) {
    return of(contact) && data.efc_vel[contact.efc_address] < -min_rebound(model);
  });
}

void Bounces::harden(const mjModel& model, mjData& data) const {
  if (empty()) return;
  const double h = model.opt.timestep;
  for (int i = 0; i < data.ncon; ++i) {
    const mjContact& contact = data.contact[i];
    if (!of(contact)) continue;
    const int row = contact.efc_address;
    const double harder = std::max(data.efc_R[row] / (kSoftness * data.efc_diagApprox[row]), 1.0);
    for (int k = row; k < row + contact.dim; ++k) {
      data.efc_R[k] /= harder;
      data.efc_D[k] *= harder;
      data.efc_KBIP[4 * k + 1] = 1.0 / h;  // a step takes away the whole velocity
    }
    data.efc_KBIP[4 * row] = 1.0 / (kRecoverySteps * h * h * data.efc_KBIP[4 * row + 2]);
  }
}

void Bounces::rebound(const mjModel& model, mjData& data, bool begins_step) const {
  if (empty()) return;
  const double limit = -min_rebound(model), h = model.opt.timestep;
  for (int i = 0; i < data.ncon; ++i) {
    const mjContact& contact = data.contact[i];
    const std::optional<double> restitution = of(contact);
    const int row = contact.efc_address;
    if (!restitution || data.efc_vel[row] >= limit) continue;
    const double closing = -data.efc_vel[row];
    const Impact impact{*restitution, closing, contact.dist, pull_of(model, contact)};
    data.efc_aref[row] = begins_step ? (rebound_speed(impact, h) + closing) / h : kOpen;
  }
}

}  // namespace doppel
