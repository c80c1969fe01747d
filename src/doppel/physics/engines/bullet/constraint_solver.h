#pragma once
// Bullet's sequential-impulse solver with the springs and dampers of joints in its mass matrix.

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <vector>

#include "doppel/physics/engines/bullet/tree_dynamics.h"

namespace doppel {

// One constraint row: factor_a * v_a = target, by an impulse within the bounds.
struct JointRow {
  int tree = -1;
  int place_a = -1;  // -1: none
  double factor_a = 1;
  double target = 0;         // rad/s or m/s
  double low = 0, high = 0;  // N m s or N s
};

// One tree of the system to solve.
struct SolverTree {
  TreeDynamics* dynamics = nullptr;
  // Inverse of the mass matrix including the terms that are implicit in the velocity.
  const Eigen::MatrixXd* inverse = nullptr;
};

class ConstraintSolver final : public btMultiBodyConstraintSolver {
 public:
  ConstraintSolver(double step, const Eigen::Vector3d& gravity);

  // Changes the velocities of the trees' bodies so that contacts and rows are satisfied, and stores the
  // impulses in the points of the manifolds. A tree has the index index_of() in `trees`.
  void solve(std::vector<SolverTree>& trees, const std::vector<JointRow>& rows,
             std::vector<btCollisionObject*>& bodies, std::vector<btPersistentManifold*>& manifolds);

 private:
  void convertContacts(btPersistentManifold** manifolds, int count, const btContactSolverInfo& info) override;
  void write_rebounds();
  void replace_responses(btMultiBodyConstraintArray& rows);
  double replace_response(const btMultiBody* body, int jacobian);
  void add_row(const JointRow& row);

  Eigen::Vector3d gravity_;
  btContactSolverInfo info_;
  std::vector<SolverTree>* trees_ = nullptr;
  const std::vector<JointRow>* rows_ = nullptr;
};

}  // namespace doppel
