#pragma once
// The integration of one step: a W-method, explicit in the forces of the rigid-body dynamics and linearly
// implicit in the springs and dampers of single joints (drives, joint damping, limit stops).
//
//   k_i = F(u + h sum_j<i alpha_ij k_j) + h J sum_j<=i gamma_ij k_j,   u_next = u + h sum_i b_i k_i
//
// with u = (q, v) and J the derivative of those springs and dampers alone. (1 - h gamma J) k_i is then the
// step's own forward dynamics with the armature h gamma D + (h gamma)^2 K on each joint, so that the
// constraint solver of an engine sees the matrix that the step is taken with. A W-method keeps its order
// whatever J leaves out, and an equilibrium of F is one of the scheme.
// Source: Steihaug and Wolfbrandt, Math. Comp. 33 (1979); Hairer and Wanner, Solving ODEs II, IV.7.

#include <array>

#include "doppel/export.h"
#include "doppel/physics/contract/world.h"

namespace doppel {

inline constexpr int kMaxStages = 4;

struct DOPPEL_API StepScheme {
  int stages = 1;
  int order = 1;  // of a motion without springs, dampers, friction, limits and contacts
  using Table = std::array<std::array<double, kMaxStages>, kMaxStages>;
  Table alpha{}, gamma{};  // strictly lower triangular; lower triangular with `diagonal` on the diagonal
  std::array<double, kMaxStages> b{};
  double diagonal = 1;
  // Semi-implicit Euler: positions move with the velocity of the step's end, and springs are evaluated at the
  // position of its start. False: springs are implicit like dampers.
  bool semi_implicit = false;

  [[nodiscard]] double time(int stage) const;       // c_i = sum_j alpha_ij, in steps
  [[nodiscard]] double gamma_sum(int stage) const;  // sum_j<=i gamma_ij
};

// `implicit` has the scheme of `euler`; the engine adds the derivatives of Coriolis forces.
DOPPEL_API const StepScheme& step_scheme(Integrator integrator);

}  // namespace doppel
