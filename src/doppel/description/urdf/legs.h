#pragma once
// The legs of a robot, by the names of its links and joints.

#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// The joints between a link and the root. Refers to the robot's joints.
class DOPPEL_API JointPaths {
 public:
  explicit JointPaths(const RobotDescription& robot);
  // From this joint up to the root; ends in a loop of joints, too.
  [[nodiscard]] std::vector<const Joint*> to_root(const Joint& joint) const;

 private:
  std::unordered_map<std::string_view, const Joint*> above_;  // by the child link
};

// Joints or links that are named as a part of a leg (knee, thigh, foot, ..., or "lower" behind a hip) and
// have two or more moving joints, their own included, between them and the root, which excludes the feet of a
// stand.
DOPPEL_API std::vector<std::string> legs_of(const RobotDescription& robot);

// The words of a name: "LHipYawPitch" and "l_hip_yaw_pitch" are both l, hip, yaw, pitch.
DOPPEL_API std::vector<std::string> words_of_name(const std::string& name);

}  // namespace doppel
