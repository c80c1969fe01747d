#pragma once

#include <vector>

#include "doppel/export.h"
#include "doppel/robot/semantics/planning_groups.h"
#include "doppel/scenario/resolve/controllers_file.h"

namespace doppel {

// The joints of every controller that a file declares with its type, in its order.
DOPPEL_API std::vector<JointGroup> joint_groups(const ControllersFile& file);

}  // namespace doppel
