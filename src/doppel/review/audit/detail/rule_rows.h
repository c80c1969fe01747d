#pragma once
// Abbreviations for the rows of the rule tables: severities, and the profiles that a rule concerns.

#include "doppel/review/audit/detail/rules.h"

namespace doppel::audit_rules {

inline constexpr Severity kError = Severity::error, kWarning = Severity::warning, kNote = Severity::note;

constexpr unsigned bit(Profile profile) {
  return static_cast<unsigned>(profile);
}
inline constexpr unsigned kControl = bit(Profile::ros2_control);
inline constexpr unsigned kGazebo = bit(Profile::gazebo);
inline constexpr unsigned kGazeboControl = kControl | kGazebo;
inline constexpr unsigned kPhysics = kGazebo | bit(Profile::mujoco);
inline constexpr unsigned kPlanning = bit(Profile::moveit);
inline constexpr unsigned kMoving = kControl | bit(Profile::moveit);

}  // namespace doppel::audit_rules
