#pragma once
// The semantic description of a robot (SRDF), by which planners know its groups of joints, named states and
// end effectors, and the pairs of links that they do not check for collisions. A faithful tree of the file,
// each element with its place; whether it fits a robot is found by the rules of review/audit. Source:
// wiki.ros.org/srdf, and srdfdom's model.cpp for what it reads.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/packages/package_resolver.h"
#include "doppel/base/xml/xml.h"
#include "doppel/export.h"

namespace doppel {

// The name of a link, joint or group that an element refers to.
struct SrdfReference {
  std::string name;
  SourceLocation source = {};
};

// The pose of the root link in a frame outside of the robot.
struct SrdfVirtualJoint {
  std::string name, type;  // fixed, planar or floating
  std::string parent_frame, child_link;
  SourceLocation source = {};
};

struct SrdfChain {
  std::string base_link, tip_link;
  SourceLocation source = {};
};

// The joints above the links, the joints, those between the ends of the chains, and those of other groups.
struct SrdfGroup {
  std::string name;
  std::vector<SrdfReference> links = {}, joints = {}, groups = {};
  std::vector<SrdfChain> chains = {};
  SourceLocation source = {};
};

struct SrdfJointValue {
  std::string joint;
  std::vector<double> values;  // rad or m; one for each position of the joint
  SourceLocation source = {};
};

struct SrdfGroupState {
  std::string name, group;
  std::vector<SrdfJointValue> values = {};
  SourceLocation source = {};
};

struct SrdfEndEffector {
  std::string name, parent_link, group, parent_group;  // parent_group: may be empty
  SourceLocation source = {};
};

struct SrdfJointProperty {
  std::string joint, property, value;
  SourceLocation source = {};
};

struct SrdfLinkPair {
  std::string link1, link2, reason;  // "Adjacent", "Never", "Default", "Always", "User", or any other text
  SourceLocation source = {};
};

struct SrdfSphere {
  Eigen::Vector3d center;  // m, in the link's frame
  double radius;           // m
};

// Spheres in the place of a link's shapes; one of radius 0 stands for a link without a shape.
struct SrdfSpheres {
  std::string link;
  std::vector<SrdfSphere> spheres = {};
  SourceLocation source = {};
};

struct DOPPEL_API SrdfDescription {
  std::string robot;  // the name of the robot that it is for
  std::vector<SrdfVirtualJoint> virtual_joints = {};
  std::vector<SrdfGroup> groups = {};
  std::vector<SrdfGroupState> states = {};
  std::vector<SrdfEndEffector> end_effectors = {};
  std::vector<SrdfReference> passive_joints = {};
  std::vector<SrdfJointProperty> properties = {};
  std::vector<SrdfReference> unchecked_links = {};  // disable_default_collisions: in no pair
  std::vector<SrdfLinkPair> disabled = {},
                            enabled = {};  // enabled: pairs of unchecked links that are checked
  std::vector<SrdfSpheres> spheres = {};
  SourceLocation source = {};

  [[nodiscard]] const SrdfGroup* find_group(std::string_view name) const;  // nullptr: none
};

// A faulty element is omitted, with a warning "srdf.element" at its place; an element or attribute that an
// SRDF does not have is a warning "srdf.unknown". Throws InputError "srdf.no_robot" for another root.
DOPPEL_API SrdfDescription read_srdf(const XmlNode& root, Diagnostics& diagnostics);

// The same of a file, after xacro. Throws also the InputErrors of expand_description.
DOPPEL_API SrdfDescription load_srdf(const std::filesystem::path& file, PackageResolver& resolver,
                                     Diagnostics& diagnostics);

// In the order of MoveIt's setup assistant.
DOPPEL_API std::string write_srdf(const SrdfDescription& srdf);

}  // namespace doppel
