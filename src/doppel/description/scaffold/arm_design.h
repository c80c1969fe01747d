#pragma once
// The dimensions of a serial arm that is upright at zero: axes, lengths, limits and the efforts that hold it.
// Units: m, kg, rad, rad/s, N m.

#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"

namespace doppel::scaffold {

inline constexpr int kMinDof = 1, kMaxDof = 16;
inline constexpr double kMinReach = 0.1, kMaxReach = 5.0, kMaxPayload = 500.0;

// Servos of which an arm can be made, one for each joint, by what their data sheets have.
struct ServoKind {
  std::string_view protocol, plugin, model;  // plugin: of doppel's driver
  double effort = 0, velocity = 0;           // stall torque, speed without load
  double limit = 0;                          // to either side, within the shaft's travel
  double reach = 0;                          // of an arm whose reach is not given
  int first_id = 1;
};
DOPPEL_API std::span<const ServoKind> servo_kinds();
inline constexpr double kPinionRadius = 0.01;  // of a gripper's servo, on the racks of its fingers

// The requirements of the user.
struct ArmRequest {
  int dof = 6;
  bool gripper = false;
  double reach = 0;  // from the shoulder to the tool, stretched out; 0: chosen by the joints and their drives
  std::optional<double> payload = {};  // not given: 0.5 kg, of servos 0.05 kg
  std::string servos = {};  // the protocol of a ServoKind; empty: drives as strong as the arm needs
};

enum class AxisKind { roll, pitch };  // about the arm's own length (z), across it (y)

// A joint and the link that it moves: a hub at the joint, and a tube up to the next joint's hub.
struct ArmJoint {
  std::string name, link;
  AxisKind axis = AxisKind::pitch;
  double length = 0;            // to the next joint, or to the tool
  double tube = 0, radius = 0;  // the tube's length and radius
  double lower = 0, upper = 0, effort = 0, velocity = 0;
  double initial = 0;  // a bent pose, because the upright one is singular
};

struct ArmDesign {
  ArmRequest request;  // with the selected reach
  double payload = 0;
  const ServoKind* servo = nullptr;  // of every joint; nullptr: none is selected
  double base_height = 0, base_radius = 0;
  std::vector<ArmJoint> joints;  // from the base to the tool
  double finger_length = 0, finger_travel = 0, finger_effort = 0;
};

// Densities of the two solids of a link, kg/m^3: a motor with its gear, and a thin-walled tube.
inline constexpr double kHubDensity = 1800, kTubeDensity = 600;
inline constexpr double kHubRatio = 1.3;  // the hub's radius, and half of its length, in radii of the tube

DOPPEL_API double link_mass(const ArmJoint& joint);
DOPPEL_API double gripper_mass(const ArmDesign& design);

// Throws InputError if the request is not within the bounds above, there is no such servo, or it is too weak.
DOPPEL_API ArmDesign design_arm(const ArmRequest& request);

}  // namespace doppel::scaffold
