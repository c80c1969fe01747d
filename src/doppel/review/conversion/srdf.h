#pragma once
// An initial SRDF for MoveIt: groups, end effectors, the virtual joint, a home state, and the pairs of links
// that need no collision checking; on request the spheres that cover the links. Source: wiki.ros.org/srdf,
// moveit_setup_assistant.

#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/clearance/link_spheres.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/robot/semantics/planning_groups.h"
#include "doppel/robot/semantics/self_collision.h"

namespace doppel {

DOPPEL_API std::string to_srdf(const Model& model, const std::vector<PlanningGroup>& groups,
                               const std::vector<DisabledPair>& disabled);
DOPPEL_API std::string to_srdf(const Model& model, const std::vector<PlanningGroup>& groups,
                               const std::vector<DisabledPair>& disabled,
                               const std::vector<LinkSpheres>& spheres);

// The covers of the links' collision shapes that are proven, for to_srdf(). A link whose cover is not is a
// warning "convert.cover". `model` is compiled from `robot`. Throws InputError: a mesh cannot be read.
DOPPEL_API std::vector<LinkSpheres> find_link_spheres(const RobotDescription& robot, const Model& model,
                                                      CollisionDetail detail, Diagnostics& diagnostics);

}  // namespace doppel
