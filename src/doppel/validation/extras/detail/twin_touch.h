#pragma once
// Contacts of the twin's robot in any configuration.

#include <utility>
#include <vector>

#include "doppel/validation/motions/machine_run.h"

namespace doppel {

// Configurations in which the twin's robot touches nothing, neither itself nor the ground, that it does not
// touch at its start.
class TwinTouch {
 public:
  explicit TwinTouch(const CheckContext& context);

  // q: [nq] of `model`, whose joints the twin has, too.
  [[nodiscard]] bool is_free(const Model& model, const Eigen::VectorXd& q);

 private:
  using Pair = std::pair<BodyId, BodyId>;
  std::vector<Pair> pairs();

  MachineRun machine_;
  std::vector<Pair> start_;
};

}  // namespace doppel
