#include "doppel/description/scaffold/arm_design.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"

namespace doppel::scaffold {
namespace {

constexpr double kGravity = 9.81;
constexpr double kRollLimit = 2.9, kPitchLimit = 2.0;
constexpr double kReserve = 2.0;       // times the effort that holds the stretched arm with its payload
constexpr double kAcceleration = 8.0;  // rad/s^2 of each joint with the arm stretched out
constexpr double kPayload = 0.5, kPayloadOfServos = 0.05;

// STS3215 at 7.4 V, XL430-W250 at 12 V, and an MG996R at 5 V, whose travel of 180 degrees has a margin.
constexpr std::array<ServoKind, 3> kServos{
    {{"feetech", "doppel/FeetechSts", "STS3215", 1.91, 5.4, kRollLimit, 0.3, 1},
     {"dynamixel", "doppel/DynamixelX", "XL430-W250", 1.4, 5.9, kRollLimit, 0.3, 1},
     {"servo_line", "doppel/ServoLine", "a hobby servo", 0.9, 5.0, 1.5, 0.22, 0}}};

const ServoKind* servo_of(const std::string& protocol) {
  if (protocol.empty()) return nullptr;
  const auto found = std::ranges::find(kServos, protocol, &ServoKind::protocol);
  if (found != kServos.end()) return &*found;
  std::vector<std::string> names;
  for (const ServoKind& one : kServos) names.emplace_back(one.protocol);
  throw InputError("new.servos", {},
                   fmt::format("there are no servos '{}'{}", protocol, did_you_mean(protocol, names)),
                   "choose feetech, dynamixel or servo_line");
}

void check_range(const char* option, double value, double least, double most, const char* unit) {
  if (value >= least && value <= most) return;
  throw InputError("new.out_of_range", {}, fmt::format("{} is {:g}", option, value),
                   fmt::format("choose a value from {:g} to {:g}{}", least, most, unit));
}

double default_reach(int dof) {
  return dof > 6 ? 0.1 * dof : std::min(0.6, 0.2 + 0.1 * dof);
}

// Two significant digits, rounded up, as in a limit that is written by hand.
double rounded_up(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1);
  return std::ceil(value / unit - 1e-9) * unit;
}

// A single joint is a pitch joint. Other arms begin with a roll joint, and alternate from the fourth joint on
// as industrial arms do.
AxisKind axis_of(int index, int dof) {
  if (dof == 1) return AxisKind::pitch;
  if (dof == 5) return index == 0 || index == 4 ? AxisKind::roll : AxisKind::pitch;
  if (dof == 6) return index == 0 || index == 3 || index == 5 ? AxisKind::roll : AxisKind::pitch;
  if (dof < 5) return index == 0 ? AxisKind::roll : AxisKind::pitch;
  return index % 2 == 0 ? AxisKind::roll : AxisKind::pitch;
}

void shape_links(ArmDesign& design) {
  const double reach = design.request.reach;
  const std::size_t first = design.joints.size() > 1 ? 1 : 0;  // behind the column that turns on the base
  const std::size_t count = design.joints.size() - first;
  const auto weight = [&](std::size_t i) {
    return count == 1 ? 1.0 : 1.0 - 0.6 * static_cast<double>(i) / static_cast<double>(count - 1);
  };
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += weight(i);
  for (std::size_t i = 0; i < count; ++i) {
    ArmJoint& joint = design.joints[first + i];
    joint.length = reach * weight(i) / sum;
    joint.radius = std::min(0.17 * joint.length, 0.05 * reach);
  }
  const double thickest = design.joints[first].radius;
  if (first == 1) {
    design.joints[0].radius = 1.1 * thickest;
    design.joints[0].length = 4.0 * thickest;
  }
  for (std::size_t i = 0; i < design.joints.size(); ++i) {
    ArmJoint& joint = design.joints[i];
    joint.tube = joint.length - (i + 1 < design.joints.size() ? kHubRatio * design.joints[i + 1].radius : 0);
  }
  design.base_radius = 2.4 * thickest;
  design.base_height = 2.0 * thickest;
  design.finger_length = 0.06 * std::sqrt(reach / 0.6);
  design.finger_travel = 0.5 * design.finger_length;
}

struct Load {
  double torque = 0, inertia = 0;
};

// The load of joint `index` where all links behind it are stretched out at right angles to its axis. The load
// of a roll joint is that of the next pitch joint behind it, held out to the side.
Load load_at(const ArmDesign& design, std::size_t index) {
  Load load;
  const auto add = [&](double mass, double distance) {
    load.torque += kGravity * mass * distance;
    load.inertia += mass * distance * distance;
  };
  std::size_t bend = index;
  while (bend + 1 < design.joints.size() && design.joints[bend].axis == AxisKind::roll) ++bend;
  double at = 0;
  for (std::size_t i = bend; i < design.joints.size(); ++i) {
    const ArmJoint& joint = design.joints[i];
    add(link_mass(joint), at + 0.5 * joint.length);
    at += joint.length;
  }
  add(design.payload, at + design.finger_length);
  if (design.request.gripper) add(gripper_mass(design), at + 0.5 * design.finger_length);
  return load;
}

void limit_joints(ArmDesign& design) {
  const double size = std::sqrt(0.6 / design.request.reach);  // large arms are slower
  const auto last = static_cast<double>(std::max<std::size_t>(design.joints.size() - 1, 1));
  for (std::size_t i = 0; i < design.joints.size(); ++i) {
    ArmJoint& joint = design.joints[i];
    joint.upper = joint.axis == AxisKind::roll ? kRollLimit : kPitchLimit;
    joint.lower = -joint.upper;
    joint.velocity = rounded_up((2.0 + 1.5 * static_cast<double>(i) / last) * std::clamp(size, 0.4, 1.5));
    const Load load = load_at(design, i);
    joint.effort = rounded_up(std::max(kReserve * load.torque, load.torque + kAcceleration * load.inertia));
  }
  const double grip = kGravity * std::max(design.payload, 0.1);
  design.finger_effort = rounded_up(4.0 * grip);  // of two fingers, by a friction of a half, twice
}

// The limits become those of the servos.
void use_servos(ArmDesign& design) {
  const ServoKind& servo = *design.servo;
  for (ArmJoint& joint : design.joints) {
    if (joint.effort > servo.effort)
      throw InputError("new.servos", {},
                       fmt::format("{} needs {:g} N m, and {} has {:g}", joint.name, joint.effort,
                                   servo.model, servo.effort),
                       fmt::format("choose a reach below {:g} m, fewer joints or a smaller payload",
                                   design.request.reach));
    joint.effort = servo.effort;
    joint.velocity = servo.velocity;
    joint.upper = std::min(joint.upper, servo.limit);
    joint.lower = -joint.upper;
  }
}

void bend_arm(ArmDesign& design) {
  constexpr double kBends[] = {0.3, 1.0, 0.6};
  std::size_t next = 0;
  for (ArmJoint& joint : design.joints) {
    if (joint.axis == AxisKind::pitch && next < std::size(kBends)) joint.initial = kBends[next++];
  }
}

}  // namespace

std::span<const ServoKind> servo_kinds() {
  return kServos;
}

double link_mass(const ArmJoint& joint) {
  const double hub = std::numbers::pi * 2 * std::pow(kHubRatio * joint.radius, 3);
  const double tube = std::numbers::pi * joint.radius * joint.radius * joint.tube;
  return kHubDensity * hub + kTubeDensity * tube;
}

double gripper_mass(const ArmDesign& design) {
  const double size = design.finger_length;
  const double palm = 1.5 * size * 0.5 * size * 0.3 * size, finger = 0.15 * size * 0.3 * size * size;
  return 1000 * (palm + 2 * finger);
}

ArmDesign design_arm(const ArmRequest& request) {
  check_range("--dof", request.dof, kMinDof, kMaxDof, " joints");
  ArmDesign design;
  design.request = request;
  design.servo = servo_of(request.servos);
  design.payload = request.payload.value_or(design.servo == nullptr ? kPayload : kPayloadOfServos);
  check_range("--payload", design.payload, 0, kMaxPayload, " kg");
  if (request.reach == 0)
    design.request.reach = design.servo == nullptr ? default_reach(request.dof) : design.servo->reach;
  check_range("--reach", design.request.reach, kMinReach, kMaxReach, " m");
  for (int i = 0; i < request.dof; ++i) {
    ArmJoint joint;
    joint.name = fmt::format("joint_{}", i + 1);
    joint.link = fmt::format("link_{}", i + 1);
    joint.axis = axis_of(i, request.dof);
    design.joints.push_back(joint);
  }
  shape_links(design);
  limit_joints(design);
  if (design.servo != nullptr) use_servos(design);
  bend_arm(design);
  return design;
}

}  // namespace doppel::scaffold
