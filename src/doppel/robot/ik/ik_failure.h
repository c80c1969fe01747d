#pragma once
// Why a pose cannot be reached, by how much, and the nearest pose that can.

#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/ik/ik_solver.h"

namespace doppel {

enum class IkObstacle {
  out_of_reach,  // of the position, whatever the rotation
  rotation,      // the position can be reached, but not with this rotation
  limits,        // joints would have to leave their limits
  refused,       // IkRequest::accepts refuses every solution that is found
};

// The variable would have to be `excess` (rad or m) beyond the limit, at `value`.
struct LimitExcess {
  int variable = -1;  // index into Chain::variables
  double value = 0, limit = 0, excess = 0;
};

struct IkFailure {
  IkObstacle obstacle = IkObstacle::out_of_reach;
  std::vector<LimitExcess> limits;  // of the branch that needs the least
  IkSolution nearest;               // the nearest pose within the limits, and accepted if there is one
  std::vector<IkSolution> refused;  // nearest to the seed first
};

// Explains a request that IkSolver::solve() has not solved.
DOPPEL_API IkFailure explain(const IkSolver& arm, const IkRequest& request);

// "elbow_joint", as the model names variable `variable`.
DOPPEL_API const std::string& variable_name(const IkSolver& arm, int variable);

// A sentence without a full stop: "out of reach by 31 mm", "elbow_joint would have to turn 12.3 deg beyond
// its upper limit of 90.0 deg". The reason of a refusal is the caller's to add.
DOPPEL_API std::string describe(const IkSolver& arm, const IkRequest& request, const IkFailure& failure);

}  // namespace doppel
