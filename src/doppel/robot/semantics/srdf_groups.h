#pragma once
// The joints of an SRDF's groups in a model.

#include <optional>
#include <vector>

#include "doppel/description/srdf/srdf.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// The joints of the group that are not fixed, in ascending order. What the model does not have, a chain
// without a way and a group inside itself contribute nothing.
DOPPEL_API std::vector<int> joints_of(const SrdfGroup& group, const SrdfDescription& srdf,
                                      const Model& model);

// True if the group is part of itself, through other groups or directly.
DOPPEL_API bool contains_itself(const SrdfGroup& group, const SrdfDescription& srdf);

}  // namespace doppel
