#pragma once
// Two descriptions compared by what they mean: kinematics, limits, mass, geometry, control. What is only
// written differently (the order of elements, an axis of length 2, rpy beyond a turn, xacro or not) is equal.

#include <string>
#include <vector>

#include "doppel/description/robot_description.h"
#include "doppel/export.h"

namespace doppel {

struct Change {
  enum class Kind { added, removed, changed, renamed };
  Kind kind = Kind::changed;
  std::string subject;   // "joint", "link", "ros2_control", "robot"
  std::string name;      // in `b`, or in `a` where it was removed
  std::string aspect;    // "velocity", "zero", "mass"; empty: the whole
  std::string from, to;  // as people read them, with units; empty where there is nothing
  std::string meaning;   // what it amounts to, in words; may be empty
};

// Below these a difference is rounding.
inline constexpr double kSameLength = 1e-7;    // m
inline constexpr double kSameAngle = 1e-6;     // rad
inline constexpr double kSameRelative = 1e-6;  // of masses, inertias, limits

// The changes that lead from `a` to `b`: the robot's own first, then joints and links in b's order, what was
// removed after them, last what surrounds them.
DOPPEL_API std::vector<Change> compare(const RobotDescription& a, const RobotDescription& b);

DOPPEL_API std::string to_json(const std::vector<Change>& changes);

}  // namespace doppel
