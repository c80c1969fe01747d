#include "doppel/scenario/schema/command_kind.h"

#include <algorithm>
#include <array>

namespace doppel {

CommandKind command_kind(std::string_view type) {
  // A controller of several interfaces of one joint takes other commands.
  constexpr std::array<std::string_view, 4> kForward = {
      "ForwardCommandController", "JointGroupPositionController", "JointGroupVelocityController",
      "JointGroupEffortController"};
  const std::string_view name = type.substr(type.rfind('/') + 1);
  if (name.ends_with("JointTrajectoryController")) return CommandKind::trajectory;
  if (name.ends_with("GripperActionController")) return CommandKind::gripper;
  return std::ranges::find(kForward, name) != kForward.end() ? CommandKind::forward : CommandKind::none;
}

}  // namespace doppel
