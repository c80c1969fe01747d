#include "doppel/physics/mujoco/contact_rules.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "doppel/physics/grasp.h"

namespace doppel {
namespace {

constexpr double kStiffer = 100;       // friction, than MuJoCo's with the impedance ratio of the world
constexpr double kAlongNormal = 1e-6;  // squared length of a direction's projection that has no direction

}  // namespace

ContactRules::ContactRules(FrictionRule rule, std::vector<RuledShape> shapes, std::vector<GripShape> grips,
                           std::vector<bool> loose)
    : rule_(rule), loose_(std::move(loose)) {
  if (rule != FrictionRule::larger || std::ranges::any_of(shapes, &RuledShape::ruled))
    shapes_ = std::move(shapes);
  const bool fingers = std::ranges::any_of(grips, [](const GripShape& g) { return g.robot >= 0; });
  const bool holdable = std::ranges::any_of(grips, [](const GripShape& g) { return g.held >= 0; });
  if (fingers && holdable) grips_ = std::move(grips);
}

bool ContactRules::ruled(const mjContact& contact) const {
  return rule_ != FrictionRule::larger || shapes_[static_cast<std::size_t>(contact.geom1)].ruled ||
         shapes_[static_cast<std::size_t>(contact.geom2)].ruled;
}

void ContactRules::apply(mjData& data) const {
  if (empty()) return;
  for (int i = 0; i < data.ncon; ++i) {
    if (ruled(data.contact[i])) apply(data, data.contact[i]);
  }
}

void ContactRules::apply(const mjData& data, mjContact& contact) const {
  const RuledShape& first = shapes_[static_cast<std::size_t>(contact.geom1)];
  const RuledShape& second = shapes_[static_cast<std::size_t>(contact.geom2)];
  PairFriction pair = combine(first.friction, second.friction, rule_);
  if (pair.directed >= 0) {
    const RuledShape& shape = pair.directed == 0 ? first : second;
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R_WB(data.xmat +
                                                                              9 * shape.direction_body);
    const Eigen::Map<const Eigen::Vector3d> normal(contact.frame);
    const Eigen::Vector3d direction = (R_WB * shape.friction.direction).normalized();
    Eigen::Vector3d along = direction - normal * normal.dot(direction);
    if (along.squaredNorm() < kAlongNormal) {
      pair.along = pair.across = std::min(pair.along, pair.across);
    } else {
      along.normalize();
      // MuJoCo scales the regularisation of the second tangent by the friction of the first: the larger one
      // has to be the first.
      if (pair.along < pair.across) {
        along = normal.cross(along);
        std::swap(pair.along, pair.across);
      }
      Eigen::Map<Eigen::Vector3d>(contact.frame + 3) = along;
      Eigen::Map<Eigen::Vector3d>(contact.frame + 6) = normal.cross(along);
    }
  } else {
    pair.across = pair.along;
  }
  contact.friction[0] = std::max(pair.along, mjMINMU);
  contact.friction[1] = std::max(pair.across, mjMINMU);
}

ContactRules::Touch ContactRules::touch_of(const mjContact& contact) const {
  const GripShape& first = grips_[static_cast<std::size_t>(contact.geom1)];
  const GripShape& second = grips_[static_cast<std::size_t>(contact.geom2)];
  if (first.robot >= 0 && second.held >= 0) return {first.robot, second.held, first.link, 1};
  if (second.robot >= 0 && first.held >= 0) return {second.robot, first.held, second.link, -1};
  return {};
}

// Whether another link of the robot touches the same body with an opposed normal.
bool ContactRules::holds(const mjData& data, const mjContact& contact) const {
  const Touch own = touch_of(contact);
  if (own.held < 0) return false;
  const Eigen::Vector3d normal = own.into * Eigen::Map<const Eigen::Vector3d>(contact.frame);
  return std::any_of(data.contact, data.contact + data.ncon, [&](const mjContact& other) {
    const Touch of = touch_of(other);
    return of.robot == own.robot && of.held == own.held && of.link != own.link &&
           opposed(normal, of.into * Eigen::Map<const Eigen::Vector3d>(other.frame));
  });
}

double ContactRules::slip_of(const mjContact& contact) const {
  if (empty()) return 0.0;
  return shapes_[static_cast<std::size_t>(contact.geom1)].friction.slip +
         shapes_[static_cast<std::size_t>(contact.geom2)].friction.slip;
}

void ContactRules::stiffen_friction(mjData& data) const {
  if (empty() && grips_.empty()) return;
  for (int i = 0; i < data.ncon; ++i) {
    mjContact& contact = data.contact[i];
    if (contact.efc_address < 0 || !slides_by_coulomb(data, contact)) continue;
    // A row of friction has the force -(a + B v) / R: at a steady v it creeps by R / B for each newton.
    const int first = contact.efc_address + 1;
    const double softest = slip_of(contact) * data.efc_KBIP[4 * first + 1];
    const double stiffer = softest > 0 ? std::min(kStiffer, data.efc_R[first] / softest) : kStiffer;
    for (int k = 1; k < contact.dim; ++k) {
      data.efc_R[contact.efc_address + k] /= stiffer;
      data.efc_D[contact.efc_address + k] *= stiffer;
    }
    contact.mu /= std::sqrt(stiffer);
  }
}

namespace {

// N, of the contact's compliance at its depth: the load on it as long as it neither sinks nor rises.
double elastic_force(const mjData& data, const mjContact& contact) {
  const int row = contact.efc_address;
  const double stiffness = data.efc_KBIP[4 * row] * data.efc_KBIP[4 * row + 2] * data.efc_D[row];
  return stiffness * std::max(data.efc_margin[row] - data.efc_pos[row], 0.0);
}

}  // namespace

void ContactRules::keep_sliding_contacts(mjData& data) const {
  if (empty() && grips_.empty() && loose_.empty()) return;
  for (int i = 0; i < data.ncon; ++i) {
    const mjContact& contact = data.contact[i];
    if (contact.efc_address < 0 || !(between_objects(contact) || slides_by_coulomb(data, contact))) continue;
    const int row = contact.efc_address;
    double* const reference = data.efc_aref + row;
    const double load = elastic_force(data, contact);
    double squares = 0.0;
    for (int k = 1; k < contact.dim; ++k) {
      const double friction = contact.friction[k - 1];
      const double stopped = friction * load * data.efc_diagApprox[row + k];
      const double slip = friction * std::max(std::abs(reference[k]) - stopped, 0.0);
      squares += slip * slip;
    }
    reference[0] -= std::sqrt(squares);
  }
}

namespace {

// Attached bodies may overlap, and do not touch each other.
void drop_contacts_of_welds(const mjModel* m, mjData* d) {
  for (int i = 0; i < m->neq; ++i) {
    if (m->eq_type[i] != mjEQ_WELD) continue;
    const int a = m->eq_obj1id[i], b = m->eq_obj2id[i];
    const auto* const end = std::remove_if(d->contact, d->contact + d->ncon, [&](const mjContact& contact) {
      const int first = m->geom_bodyid[contact.geom1], second = m->geom_bodyid[contact.geom2];
      return (first == a && second == b) || (first == b && second == a);
    });
    d->ncon = static_cast<int>(end - d->contact);
  }
}

}  // namespace

void compute_contacts_and_constraints(const mjModel* m, mjData* d, const ContactRules& rules,
                                      const Bounces& bounces, IslandSolver& islands, bool begins_step) {
  mj_checkPos(m, d);
  mj_checkVel(m, d);
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_camlight(m, d);
  mj_tendon(m, d);
  mj_crb(m, d);
  mj_factorM(m, d);
  mj_collision(m, d);
  drop_contacts_of_welds(m, d);
  rules.apply(*d);
  mj_makeConstraint(m, d);
  bounces.harden(*m, *d);
  rules.stiffen_friction(*d);
  mj_comVel(m, d);
  mj_passive(m, d);
  islands.refer(*m, *d);
  bounces.rebound(*m, *d, begins_step);
  mj_rne(m, d, 0, d->qfrc_bias);
  rules.keep_sliding_contacts(*d);
}

}  // namespace doppel
