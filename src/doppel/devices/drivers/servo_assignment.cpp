#include "doppel/devices/drivers/servo_assignment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

constexpr double kTravel = 3.0;  // rad of the shaft to either side, of a turn's pi
constexpr double kSpeed = 4.0;   // rad/s of the shaft, of a joint without a speed limit
constexpr double kMinScale = 0.01, kMaxScale = 100;

// Shaft per joint, so that the joint's limits are within the travel. A joint without limits turns as its
// servo does, within one turn.
double scale_of(const ModelJoint& joint) {
  const double reach = std::max(std::abs(joint.lower), std::abs(joint.upper));
  if (!std::isfinite(reach) || !(reach > 0)) return 1;
  const bool fits = joint.type != JointType::prismatic && reach <= kTravel;
  return fits ? 1 : std::clamp(kTravel / reach, kMinScale, kMaxScale);
}

std::string_view plugin_of(ServoProtocol protocol) {
  return std::ranges::find(servo_plugins(), protocol, &ServoPlugin::protocol)->name;
}

}  // namespace

bool assign_servos(HardwareDescription& hardware, const Model& model, ServoProtocol protocol) {
  if (is_servo_plugin(hardware.plugin)) return true;
  const bool board = protocol == ServoProtocol::servo_line;
  int id = board ? 0 : 1;
  bool any = false;
  for (HardwareJointDescription& joint : hardware.joints) {
    std::erase_if(joint.command_interfaces,
                  [](const HardwareInterfaceDescription& one) { return one.name != kPosition; });
    const int index = model.find_joint(joint.name);
    if (index < 0 || !model.joints[static_cast<std::size_t>(index)].scalar())
      joint.command_interfaces.clear();
    if (joint.command_interfaces.empty()) continue;
    const ModelJoint& of_model = model.joints[static_cast<std::size_t>(index)];
    const double scale = scale_of(of_model);
    joint.params = {
        {"id", fmt::format("{}", id++)}, {"scale", fmt::format("{:.17g}", scale)}, {"offset_deg", "0"}};
    if (!std::isfinite(of_model.velocity) || !(of_model.velocity > 0))
      joint.params.emplace_back("velocity", fmt::format("{:.17g}", kSpeed / scale));
    if (board) joint.params.emplace_back("travel_deg", "360");
    any = true;
  }
  if (!any) return false;
  hardware.plugin = plugin_of(protocol);
  // There is no machine whose first motions have to be slow, or whose pose a person can confirm.
  hardware.params = {{"gentle", "never"}, {"confirm_pose", "false"}};
  return true;
}

}  // namespace doppel
