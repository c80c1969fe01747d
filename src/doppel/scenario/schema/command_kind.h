#pragma once
// The kinds of commands that types of controllers take.

#include <string_view>

#include "doppel/export.h"

namespace doppel {

enum class CommandKind {
  none,        // broadcasters, bases, chained controllers, and types that are not known
  trajectory,  // ~/joint_trajectory and ~/follow_joint_trajectory
  gripper,     // ~/gripper_cmd
  forward,     // ~/commands: one value for each joint, which is applied at once
};

// `type`: "position_controllers/JointGroupPositionController".
DOPPEL_API CommandKind command_kind(std::string_view type);

}  // namespace doppel
