#include "doppel/physics/contract/step_scheme.h"

#include <numeric>

namespace doppel {
namespace {

StepScheme make_euler() {
  StepScheme euler;
  euler.gamma[0][0] = 1.0;
  euler.b[0] = 1.0;
  euler.semi_implicit = true;
  return euler;
}

// The explicit midpoint rule where J = 0. Order 2 for any J requires gamma_21 = -gamma; gamma = 1 - 1/sqrt(2)
// makes it L-stable where J is exact.
StepScheme make_midpoint() {
  StepScheme midpoint;
  midpoint.stages = midpoint.order = 2;
  midpoint.diagonal = 0.29289321881345247560;
  midpoint.alpha[1][0] = 0.5;
  midpoint.b[1] = 1.0;
  midpoint.gamma[0][0] = midpoint.gamma[1][1] = midpoint.diagonal;
  midpoint.gamma[1][0] = -midpoint.diagonal;
  return midpoint;
}

// The classical Runge-Kutta method where J = 0. These gamma are the solution of the order conditions of a
// W-method up to order 3 (any J), of R(infinity) = 0 and gamma_21 = -gamma, at gamma = 1/4; A-stable, and no
// stage exceeds the start. StepScheme.TablesFulfilOrderConditions checks all of it.
StepScheme make_rk4() {
  StepScheme rk4;
  rk4.stages = rk4.order = 4;
  rk4.diagonal = 1.0 / 4;
  rk4.alpha[1][0] = rk4.alpha[2][1] = 0.5;
  rk4.alpha[3][2] = 1.0;
  rk4.b = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
  rk4.gamma = {
      {{1.0 / 4}, {-1.0 / 4, 1.0 / 4}, {7.0 / 32, -23.0 / 32, 1.0 / 4}, {1.0 / 16, -1.0 / 16, 0.0, 1.0 / 4}}};
  return rk4;
}

}  // namespace

double StepScheme::time(int stage) const {
  const auto& row = alpha[static_cast<std::size_t>(stage)];
  return std::accumulate(row.begin(), row.end(), 0.0);
}

double StepScheme::gamma_sum(int stage) const {
  const auto& row = gamma[static_cast<std::size_t>(stage)];
  return std::accumulate(row.begin(), row.end(), 0.0);
}

const StepScheme& step_scheme(Integrator integrator) {
  static const StepScheme euler = make_euler(), midpoint = make_midpoint(), rk4 = make_rk4();
  switch (integrator) {
    case Integrator::midpoint:
      return midpoint;
    case Integrator::rk4:
      return rk4;
    case Integrator::euler:
    case Integrator::implicit:
      break;
  }
  return euler;
}

}  // namespace doppel
