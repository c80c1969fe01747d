#pragma once
// Private to the MuJoCo back end: instances that do not touch are solved apart. MuJoCo 2.2 solves the
// constraints of a world as one problem, whose iterations and tolerance move the last bits of every robot
// with the contacts of all others. An island is a set of instances that contacts or couplings join. MuJoCo
// solves each as if it were alone, so that its motion is bit-identical to that in a world without the others,
// and the cost grows with the sum of the cubes of the islands' sizes instead of the cube of the sum.

#include <mujoco/mujoco.h>

#include <vector>

#include "doppel/physics/engines/mujoco/sliding.h"
#include "doppel/physics/engines/mujoco/state_data.h"

namespace doppel {

class ContactRules;

// The instances in MuJoCo's indices; immutable.
struct IslandLayout {
  std::vector<int> instance_of_body;  // [bodies] -1: the ground
  std::vector<int> first_dof;         // [instances + 1]
  [[nodiscard]] int instances() const { return static_cast<int>(first_dof.size()) - 1; }
  [[nodiscard]] int dofs(int instance) const {
    return first_dof[static_cast<std::size_t>(instance) + 1] - first_dof[static_cast<std::size_t>(instance)];
  }
};

// Scratch of one state: nothing is kept from one call to the next. Allocates only when it is made.
class IslandSolver {
 public:
  // `layout` and `rules` have to outlive this.
  IslandSolver(const mjModel& model, const IslandLayout& layout, const ContactRules& rules);

  // mj_referenceConstraint. Precondition: the rows belong to the present positions.
  void refer(const mjModel& model, mjData& data);
  // mj_fwdConstraint, with Coulomb's law where the rules have it: the references of the normals of contacts that
  // slide are changed. Precondition: qacc_smooth is that of the present efforts.
  void solve(const mjModel& model, mjData& data);

 private:
  // Lists through next_instance_ and next_row_; -1: empty.
  struct Island {
    int first_instance = -1, first_row = -1;
  };

  // False: everything is one island, which MuJoCo solves in place.
  bool divide(const mjModel& model, const mjData& data);
  [[nodiscard]] int root(int instance);
  void join(int a, int b);
  [[nodiscard]] int join_row(const mjModel& model, const mjData& data, int row);
  void enter(const mjModel& model, mjData& data, const Island& island);
  void take_masses(const mjModel& model, const mjData& data);
  void take_rows(const mjModel& model, const mjData& data);
  void take_row(const mjModel& model, const mjData& data, int to);
  void transpose_rows();
  void solve_island(mjData& data);
  void solve_rows(const mjModel& model, mjData& data);

  const IslandLayout* layout_;
  const ContactRules* rules_;
  mjModel model_;    // of the entered island: its sizes, and its part of the mass matrix
  DataHandle data_;  // of the entered island; none where there is at most one instance that moves
  std::vector<int> parent_id_, mass_row_, simple_;  // [nv] of model_
  std::vector<int> parent_, next_instance_;         // [instances] union-find; list
  std::vector<int> row_instance_, next_row_;        // [njmax] an instance of the row, -1: none moves; list
  std::vector<Island> islands_;                     // [instances] at their roots
  std::vector<int> dofs_, rows_;                    // of the entered island, in the whole
  SlidingRows sliding_;                             // of the entered island
  std::vector<int> column_;                         // [nv] of the whole in the entered island
};

}  // namespace doppel
