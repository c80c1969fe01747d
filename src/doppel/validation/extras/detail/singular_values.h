#pragma once
// The least singular value of an arm's Jacobian, by its largest one.

#include <Eigen/Core>
#include <vector>

#include "doppel/robot/lanes/chain.h"

namespace doppel {

struct SingularValues {
  double ratio = 0;            // least / largest, over the numbers of a pose that the arm sets; 0: singular
  std::vector<int> variables;  // those that move the tool least together, the largest part first
};

// The scaled Jacobian at u [variables]; `freedom`: TaskSpace::freedom.
[[nodiscard]] SingularValues singular_values(const Chain& chain, const Eigen::VectorXd& u, int freedom);

}  // namespace doppel
