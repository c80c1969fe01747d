#pragma once
// The joints of an SRDF's groups in a model.

#include <optional>
#include <vector>

#include "doppel/description/srdf/srdf.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// The joints between two links, parents first, fixed ones included; nullopt: `tip_link` is not below
// `base_link`. Both are indices into Model::links.
DOPPEL_API std::optional<std::vector<int>> joints_between(const Model& model, int base_link, int tip_link);

// The joints of the group that are not fixed, in ascending order. What the model does not have, a chain
// without a way and a group inside itself contribute nothing.
DOPPEL_API std::vector<int> joints_of(const SrdfGroup& group, const SrdfDescription& srdf,
                                      const Model& model);

// True if the group is part of itself, through other groups or directly.
DOPPEL_API bool contains_itself(const SrdfGroup& group, const SrdfDescription& srdf);

}  // namespace doppel
