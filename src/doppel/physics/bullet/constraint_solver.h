#pragma once
// Bullet's sequential impulses, with the springs and dampers of joints in the matrix that contacts and joints
// are solved with.

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <vector>

#include "doppel/physics/bullet/tree_dynamics.h"

namespace doppel {

// factor_a * v_a + factor_b * v_b is to be `target`, by an impulse within bounds. Both places are in one
// tree.
struct JointRow {
  int tree = -1;
  int place_a = -1, place_b = -1;  // -1: none
  double factor_a = 1, factor_b = 0;
  double target = 0;         // rad/s or m/s
  double low = 0, high = 0;  // N m s or N s
};

// What a tree brings into a solution.
struct SolverTree {
  TreeDynamics* dynamics = nullptr;
  // Of the mass matrix with what is implicit in the velocity.
  const Eigen::MatrixXd* inverse = nullptr;
};

class ConstraintSolver final : public btMultiBodyConstraintSolver {
 public:
  explicit ConstraintSolver(double step);

  // Changes the velocities of the trees' bodies so that contacts and rows hold, and leaves the impulses in
  // the points of the manifolds. Trees stand at their index_of().
  void solve(std::vector<SolverTree>& trees, const std::vector<JointRow>& rows,
             std::vector<btCollisionObject*>& bodies, std::vector<btPersistentManifold*>& manifolds);

 private:
  void convertContacts(btPersistentManifold** manifolds, int count, const btContactSolverInfo& info) override;
  void replace_responses(btMultiBodyConstraintArray& rows);
  double replace_response(const btMultiBody* body, int jacobian);
  void add_row(const JointRow& row);

  btContactSolverInfo info_;
  std::vector<SolverTree>* trees_ = nullptr;
  const std::vector<JointRow>* rows_ = nullptr;
};

}  // namespace doppel
