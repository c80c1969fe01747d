#pragma once
// Compares two descriptions by their meaning: kinematics, limits, mass, geometry, control. Differences of
// notation only (the order of elements, an axis of length 2, rpy beyond a turn, xacro or not) are ignored.

#include <string>
#include <vector>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

struct Change {
  enum class Kind { added, removed, changed, renamed };
  Kind kind = Kind::changed;
  std::string subject;   // "joint", "link", "ros2_control", "robot"
  std::string name;      // in `b`, or in `a` if it was removed
  std::string aspect;    // "velocity", "zero", "mass"; empty: the whole
  std::string from, to;  // values with units, as text; empty: absent
  std::string meaning;   // the effect, in words; may be empty
};

// Smaller differences are rounding.
inline constexpr double kSameLength = 1e-7;    // m
inline constexpr double kSameAngle = 1e-6;     // rad
inline constexpr double kSameRelative = 1e-6;  // of masses, inertias, limits

// The changes from `a` to `b`: those of the robot first, then joints and links in b's order, then removed
// ones, then <ros2_control> components and <gazebo> plugins.
DOPPEL_API std::vector<Change> compare(const RobotDescription& a, const RobotDescription& b);

DOPPEL_API std::string to_json(const std::vector<Change>& changes);

}  // namespace doppel
