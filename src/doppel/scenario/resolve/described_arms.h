#pragma once
// The arms of a robot with all that belongs to its description: groups of its semantic description (SRDF)
// under their names, and those that are found from its controllers or its tree.

#include <vector>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/description/urdf/load.h"
#include "doppel/export.h"
#include "doppel/robot/reach/arm_group.h"

namespace doppel {

// `target`: nullptr for a robot that was not read from a file, which has no SRDF.
DOPPEL_API std::vector<ArmGroup> described_arms(const Model& model, const RobotDescription& robot,
                                                const Target* target, PackageResolver& resolver,
                                                const std::vector<JointGroup>& controllers,
                                                Diagnostics& notes);

}  // namespace doppel
