#pragma once
// The root link of a description that is not compiled yet.

#include <set>
#include <string>
#include <string_view>

#include "doppel/description/urdf/robot_description.h"

namespace doppel {

// The first link that is not the child of a joint; empty: there is none.
inline std::string root_link_of(const RobotDescription& robot) {
  std::set<std::string_view> children;
  for (const Joint& joint : robot.joints) children.insert(joint.child);
  for (const Link& link : robot.links) {
    if (!children.contains(link.name)) return link.name;
  }
  return "";
}

}  // namespace doppel
