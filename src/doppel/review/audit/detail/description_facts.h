#pragma once
// Small queries of a description that several rules use.

#include <optional>
#include <string>
#include <vector>

#include "doppel/base/math/mass_properties.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/meshes/mesh_report.h"
#include "doppel/description/urdf/robot_description.h"

namespace doppel::audit_rules {

std::string subject(const Joint& joint);  // "joint 'Revolute 1'"
std::string subject(const Link& link);
bool same_place(const SourceLocation& a, const SourceLocation& b);
// The place belongs to the node, to one of its attributes or to a descendant.
bool holds(const XmlNode& node, const SourceLocation& where);
// The element that begins at this place; null: none.
const XmlNode* element_at(const XmlNode& root, const SourceLocation& where);
// "gripper_left_1" -> "gripper_right_1"; "l_finger" -> "r_finger", in lower case. Empty: neither left nor
// right.
std::string mirrored_name(const std::string& name);
std::string names_of(const std::vector<std::string>& names,
                     std::size_t at_most = 4);  // "'a', 'b' and 3 more"

// Links that are connected by fixed joints: one rigid body for the physics.
struct Body {
  std::vector<const Link*> links;  // from the one nearest to the root
  const Joint* joint = nullptr;    // carries it; null: the root's body
  MassProperties mass;             // of all its <inertial>s, in the first link's frame
  bool weighed = false;            // one of its links has an <inertial>
};
// In an invalid tree: those that are reachable from a root.
std::vector<Body> bodies(const RobotDescription& robot);

// The triangles of a link's collision meshes: the cost of checking them.
std::size_t collision_triangles(const Link& link);

// All visual and collision shapes of a link, in the link's frame. Nothing where a shape is unknown (a mesh
// that is not found) or there is none.
struct LinkShape {
  Eigen::AlignedBox3d bounds;
  std::vector<Eigen::Vector3d> hull;
  SolidProperties solid;   // of the visuals, else of the collisions; volume 0: one of them is not closed
  double hull_volume = 0;  // m^3, the hulls' sum: no more than this is filled
  [[nodiscard]] double size() const { return bounds.diagonal().norm(); }
};
std::optional<LinkShape> link_shape(const Link& link);

}  // namespace doppel::audit_rules
