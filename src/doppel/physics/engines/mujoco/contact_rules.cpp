#include "doppel/physics/engines/mujoco/contact_rules.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "doppel/physics/contract/grasp.h"

namespace doppel {
namespace {

constexpr double kStiffer = 100;         // friction, than MuJoCo's with the impedance ratio of the world
constexpr double kSlipTolerance = 1e-3;  // of the acceleration of the contact by its own force
constexpr double kMinFactor = 0.25, kMaxFactor = 16;  // of a correction, of the secant method
constexpr double kAlongNormal = 1e-6;  // squared length of a direction's projection that has no direction

std::size_t at_row(int row) {
  return static_cast<std::size_t>(row);
}

double square(double x) {
  return x * x;
}

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

// Sets the friction of a contact along two tangents. With a direction, the contact's frame is turned about
// the normal, so that its first tangent is the direction projected into the plane of contact.
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

// True if another link of the robot touches the same body with an opposed normal.
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
double elastic_force(const mjData& data, int row) {
  const double stiffness = data.efc_KBIP[4 * row] * data.efc_KBIP[4 * row + 2] * data.efc_D[row];
  return stiffness * std::max(data.efc_margin[row] - data.efc_pos[row], 0.0);
}

// Calls visit(row of the normal, contact) for each contact with friction of the island or world.
template <class Visit>
void for_each_cone(const mjData& data, Visit visit) {
  for (int row = 0; row < data.nefc;) {
    if (data.efc_type[row] != mjCNSTR_CONTACT_ELLIPTIC) {
      ++row;
      continue;
    }
    const mjContact& contact = data.contact[data.efc_id[row]];
    visit(row, contact);
    row += contact.dim;
  }
}

// m/s^2: of the slip that friction does not stop while the contact carries its elastic force.
double unstopped_slip(const mjData& data, const mjContact& contact, int row) {
  const double load = elastic_force(data, row);
  double squares = 0.0;
  for (int k = 1; k < contact.dim; ++k) {
    const double friction = contact.friction[k - 1];
    const double stopped = friction * load * data.efc_diagApprox[row + k];
    squares += square(friction * std::max(std::abs(data.efc_aref[row + k]) - stopped, 0.0));
  }
  return std::sqrt(squares);
}

// m/s^2: of the slip at these accelerations of the rows; `loaded`: and at the forces of the solution.
double slip_at(const mjData& data, const mjContact& contact, int row, const double* acceleration,
               bool loaded) {
  double squares = 0.0;
  for (int k = row + 1; k < row + contact.dim; ++k) {
    const double yielding = loaded ? data.efc_R[k] * data.efc_force[k] : 0.0;
    squares += square(contact.friction[k - row - 1] * (acceleration[k] - data.efc_aref[k] + yielding));
  }
  return std::sqrt(squares);
}

}  // namespace

void ContactRules::expect_slip(const mjModel& model, mjData& data, SlidingRows& sliding) const {
  if (!correct_slips()) return;
  bool slides = false;
  for_each_cone(data, [&](int row, const mjContact& contact) {
    const bool obeys = obeys_coulomb(data, contact);
    sliding.reference[at_row(row)] = data.efc_aref[row];
    sliding.slip[at_row(row)] = sliding.earlier_slip[at_row(row)] =
        obeys ? unstopped_slip(data, contact, row) : 0.0;
    slides = slides || sliding.slip[at_row(row)] > 0;
  });
  if (!slides) return;
  // A contact that friction stops within the step begins without slip: a wheel of large friction grips, and would
  // otherwise lift off and spin, which is a solution, too. Other slips mostly go on as in the step before.
  mj_mulJacVec(&model, &data, sliding.acceleration.data(), data.qacc_warmstart);
  for_each_cone(data, [&](int row, const mjContact& contact) {
    double& slip = sliding.slip[at_row(row)];
    if (slip > 0) slip = slip_at(data, contact, row, sliding.acceleration.data(), false);
    sliding.earlier_slip[at_row(row)] = slip;
    data.efc_aref[row] -= slip;
  });
}

// Each contact is corrected by the secant method. By repeated substitution, a light wheel of large friction would
// take tens of solutions. The law need not hold at a contact that is open and parts.
bool ContactRules::correct_slip(const mjModel& model, mjData& data, SlidingRows& sliding) const {
  if (!correct_slips()) return false;
  bool computed = false, changed = false;
  for_each_cone(data, [&](int row, const mjContact& contact) {
    double& slip = sliding.slip[at_row(row)];
    double& earlier = sliding.earlier_slip[at_row(row)];
    double& earlier_gap = sliding.earlier_gap[at_row(row)];
    const bool sticks = data.efc_state[row] == mjCNSTRSTATE_QUADRATIC;
    if ((sticks && slip == 0) || !obeys_coulomb(data, contact)) return;
    if (!std::exchange(computed, true)) mj_mulJacVec(&model, &data, sliding.acceleration.data(), data.qacc);
    const double parting = sliding.acceleration[at_row(row)] - sliding.reference[at_row(row)];
    const bool open = data.efc_state[row] == mjCNSTRSTATE_SATISFIED;
    if (open && parting >= 0) return;
    const double solved = sticks ? 0.0 : slip_at(data, contact, row, sliding.acceleration.data(), true);
    const double gap = solved - slip;
    const double pressed = data.efc_diagApprox[row] * data.efc_force[row];
    if (std::abs(gap) <= kSlipTolerance * std::max(pressed, 1.0)) return;
    const double rate = slip == earlier ? -1.0 : (gap - earlier_gap) / (slip - earlier);
    const double factor = rate < 0 ? std::clamp(-1.0 / rate, kMinFactor, kMaxFactor) : 1.0;
    earlier_gap = gap;
    earlier = slip;
    slip = std::max(slip + factor * gap, 0.0);
    data.efc_aref[row] = sliding.reference[at_row(row)] - slip;
    changed = changed || slip != earlier;
  });
  return changed;
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

// The part of MuJoCo's forward dynamics up to the constraints, in its order, with the rules between its
// stages: contacts are changed after the collision detection, rows after they are made, and the reference
// after the passive forces.
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
}

}  // namespace doppel
