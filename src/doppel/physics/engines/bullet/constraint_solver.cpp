#include "doppel/physics/engines/bullet/constraint_solver.h"

#include <algorithm>

#include "doppel/physics/contract/detail/contact_rule.h"
#include "doppel/physics/engines/bullet/contact_finder.h"

namespace doppel {
namespace {

constexpr int kIterations = 500;               // at most; with Bullet's default of 10 a held stack creeps
constexpr double kResidual = 1e-10;            // rad/s or m/s: largest change of the last iteration
constexpr double kPenetrationReduction = 0.2;  // of a penetration in one step
constexpr double kSlop = 1e-5;  // m: penetration of bodies at rest, so that they stay in contact

}  // namespace

ConstraintSolver::ConstraintSolver(double step, const Eigen::Vector3d& gravity) : gravity_(gravity) {
  info_.m_timeStep = step;
  info_.m_numIterations = kIterations;
  info_.m_leastSquaresResidualThreshold = kResidual * kResidual;
  info_.m_erp2 = kPenetrationReduction;
  info_.m_linearSlop = kSlop;
  // Two friction directions give Coulomb's cone. No warm start, neither for contacts nor for joints, so that
  // a step depends only on the state that it begins with.
  info_.m_solverMode = SOLVER_USE_2_FRICTION_DIRECTIONS;
  info_.m_splitImpulse = 0;  // not supported by btMultiBody
}

void ConstraintSolver::solve(std::vector<SolverTree>& trees, const std::vector<JointRow>& rows,
                             std::vector<btCollisionObject*>& bodies,
                             std::vector<btPersistentManifold*>& manifolds) {
  trees_ = &trees;
  rows_ = &rows;
  for (SolverTree& tree : trees) tree.dynamics->body().setCompanionId(-1);
  solveMultiBodyGroup(bodies.data(), static_cast<int>(bodies.size()), manifolds.data(),
                      static_cast<int>(manifolds.size()), nullptr, 0, nullptr, 0, info_, nullptr, nullptr);
  for (SolverTree& tree : trees) tree.dynamics->body().processDeltaVeeMultiDof2();
}

void ConstraintSolver::convertContacts(btPersistentManifold** manifolds, int count,
                                       const btContactSolverInfo& info) {
  btMultiBodyConstraintSolver::convertContacts(manifolds, count, info);
  replace_responses(m_multiBodyNormalContactConstraints);
  replace_responses(m_multiBodyFrictionContactConstraints);
  write_rebounds();
  for (const JointRow& row : *rows_) add_row(row);
}

namespace {

double velocity_along(const btMultiBody* body, const btScalar* jacobian) {
  double out = 0.0;
  for (int i = 0; body != nullptr && i < body->getNumDofs() + 6; ++i)
    out += body->getVelocityVector()[i] * jacobian[i];
  return out;
}

}  // namespace

// Bullet's rebound would add the velocity with which it removes the penetration that the impact leaves.
void ConstraintSolver::write_rebounds() {
  for (int i = 0; i < m_multiBodyNormalContactConstraints.size(); ++i) {
    btMultiBodySolverConstraint& row = m_multiBodyNormalContactConstraints[i];
    const auto* const point = static_cast<const btManifoldPoint*>(row.m_originalContactPoint);
    if (point == nullptr || (point->m_contactPointFlags & kHasRestitution) == 0) continue;
    const double present = velocity_along(row.m_multiBodyA, &m_data.m_jacobians[row.m_jacAindex]) +
                           velocity_along(row.m_multiBodyB, &m_data.m_jacobians[row.m_jacBindex]);
    const double h = info_.m_timeStep, distance = point->getDistance();
    const bool meets = distance <= 0 || -present * h > distance;
    double target = distance > 0 ? -distance / h : -distance / (kRecoverySteps * h);
    const double along = gravity_.dot(from_bullet(point->m_normalWorldOnB));
    const bool a = row.m_multiBodyA != nullptr, b = row.m_multiBodyB != nullptr;
    const double pull = a == b ? 0.0 : std::max(a ? -along : along, 0.0);
    const double closing = -(present + h * pull);  // without the weight of this step
    if (meets && closing > min_rebound_speed(gravity_, h))
      target = rebound_speed({point->m_combinedRestitution, closing, distance, pull}, h);
    row.m_rhs = (target - present) * row.m_jacDiagABInv;
    row.m_rhsPenetration = 0.0;
  }
}

// Replaces Bullet's response of the bare bodies to a unit impulse by that of the bodies with implicit drives,
// which is smaller. Returns the response in the row's direction.
double ConstraintSolver::replace_response(const btMultiBody* body, int jacobian) {
  if (body == nullptr) return 0.0;
  const SolverTree& tree = (*trees_)[static_cast<std::size_t>(TreeDynamics::index_of(*body))];
  const int size = tree.dynamics->size();
  const Eigen::Map<const Eigen::VectorXd> J(&m_data.m_jacobians[jacobian], size);
  Eigen::Map<Eigen::VectorXd> response(&m_data.m_deltaVelocitiesUnitImpulse[jacobian], size);
  response.noalias() = tree.inverse->selfadjointView<Eigen::Lower>() * J;
  return J.dot(response);
}

void ConstraintSolver::replace_responses(btMultiBodyConstraintArray& rows) {
  for (int i = 0; i < rows.size(); ++i) {
    btMultiBodySolverConstraint& row = rows[i];
    const double before = row.m_jacDiagABInv;
    if (!(before > 0)) continue;
    const double response = replace_response(row.m_multiBodyA, row.m_jacAindex) +
                            replace_response(row.m_multiBodyB, row.m_jacBindex);
    row.m_jacDiagABInv = response > SIMD_EPSILON ? 1.0 / response : 0.0;
    row.m_rhs *= row.m_jacDiagABInv / before;
  }
}

void ConstraintSolver::add_row(const JointRow& row) {
  TreeDynamics& dynamics = *(*trees_)[static_cast<std::size_t>(row.tree)].dynamics;
  btMultiBody& body = dynamics.body();
  const int size = dynamics.size();
  btMultiBodySolverConstraint& out = m_multiBodyNonContactConstraints.expandNonInitializing();
  out.m_multiBodyA = &body;
  out.m_multiBodyB = nullptr;
  out.m_linkA = out.m_linkB = -1;
  out.m_solverBodyIdA = out.m_solverBodyIdB = -1;
  out.m_orgConstraint = nullptr;
  out.m_orgDofIndex = -1;
  out.m_originalContactPoint = nullptr;
  out.m_contactNormal1.setZero();
  out.m_relpos1CrossNormal.setZero();
  out.m_appliedImpulse = 0.0;
  out.m_appliedPushImpulse = 0.0;
  out.m_rhsPenetration = 0.0;
  out.m_cfm = 0.0;
  out.m_friction = 0.0;
  out.m_lowerLimit = row.low;
  out.m_upperLimit = row.high;
  if (body.getCompanionId() < 0) {
    body.setCompanionId(m_data.m_deltaVelocities.size());
    m_data.m_deltaVelocities.resize(m_data.m_deltaVelocities.size() + size, 0.0);
  }
  out.m_deltaVelAindex = body.getCompanionId();
  out.m_jacAindex = m_data.m_jacobians.size();
  m_data.m_jacobians.resize(out.m_jacAindex + size, 0.0);
  m_data.m_deltaVelocitiesUnitImpulse.resize(out.m_jacAindex + size, 0.0);
  const btScalar* const velocity = body.getVelocityVector();
  m_data.m_jacobians[out.m_jacAindex + row.place_a] = row.factor_a;
  const double present = row.factor_a * velocity[row.place_a];
  const double response = replace_response(&body, out.m_jacAindex);
  out.m_jacDiagABInv = response > 0 ? 1.0 / response : 0.0;
  out.m_rhs = (row.target - present) * out.m_jacDiagABInv;
}

}  // namespace doppel
