#include "doppel/review/conversion/srdf.h"

#include "doppel/robot/semantics/derived_srdf.h"

namespace doppel {

std::string to_srdf(const Model& model, const std::vector<PlanningGroup>& groups,
                    const std::vector<DisabledPair>& disabled) {
  return write_srdf(derived_srdf(model, groups, disabled));
}

}  // namespace doppel
