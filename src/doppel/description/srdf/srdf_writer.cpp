#include "doppel/base/math/decimals.h"
#include "doppel/base/xml/element.h"
#include "doppel/description/srdf/srdf.h"

namespace doppel {
namespace {

XmlNode to_element(const SrdfGroup& group) {
  XmlNode node = element("group", {{"name", group.name}});
  for (const SrdfReference& link : group.links)
    node.children.push_back(element("link", {{"name", link.name}}));
  for (const SrdfReference& joint : group.joints)
    node.children.push_back(element("joint", {{"name", joint.name}}));
  for (const SrdfChain& chain : group.chains)
    node.children.push_back(element("chain", {{"base_link", chain.base_link}, {"tip_link", chain.tip_link}}));
  for (const SrdfReference& other : group.groups)
    node.children.push_back(element("group", {{"name", other.name}}));
  return node;
}

XmlNode to_element(const SrdfGroupState& state) {
  XmlNode node = element("group_state", {{"name", state.name}, {"group", state.group}});
  for (const SrdfJointValue& joint : state.values) {
    std::string values;
    for (const double value : joint.values) values += (values.empty() ? "" : " ") + decimal(value);
    node.children.push_back(element("joint", {{"name", joint.joint}, {"value", values}}));
  }
  return node;
}

XmlNode to_element(const SrdfEndEffector& effector) {
  XmlNode node =
      element("end_effector",
              {{"name", effector.name}, {"parent_link", effector.parent_link}, {"group", effector.group}});
  if (!effector.parent_group.empty()) add_attribute(node, "parent_group", effector.parent_group);
  return node;
}

XmlNode to_element(const SrdfVirtualJoint& joint) {
  return element("virtual_joint", {{"name", joint.name},
                                   {"type", joint.type},
                                   {"parent_frame", joint.parent_frame},
                                   {"child_link", joint.child_link}});
}

XmlNode to_element(const SrdfJointProperty& property) {
  return element(
      "joint_property",
      {{"joint_name", property.joint}, {"property_name", property.property}, {"value", property.value}});
}

XmlNode to_element(const SrdfSpheres& cover) {
  XmlNode node = element("link_sphere_approximation", {{"link", cover.link}});
  for (const SrdfSphere& sphere : cover.spheres)
    node.children.push_back(
        element("sphere", {{"center", decimals(sphere.center)}, {"radius", decimal(sphere.radius)}}));
  return node;
}

XmlNode pair_element(const char* name, const SrdfLinkPair& pair) {
  XmlNode node = element(name, {{"link1", pair.link1}, {"link2", pair.link2}});
  if (!pair.reason.empty()) add_attribute(node, "reason", pair.reason);
  return node;
}

template <class T>
void append(XmlNode& robot, const std::vector<T>& list) {
  for (const T& one : list) robot.children.push_back(to_element(one));
}

}  // namespace

std::string write_srdf(const SrdfDescription& srdf) {
  XmlNode robot = element("robot", {{"name", srdf.robot}});
  append(robot, srdf.groups);
  append(robot, srdf.states);
  append(robot, srdf.end_effectors);
  append(robot, srdf.virtual_joints);
  for (const SrdfReference& joint : srdf.passive_joints)
    robot.children.push_back(element("passive_joint", {{"name", joint.name}}));
  append(robot, srdf.properties);
  append(robot, srdf.spheres);
  for (const SrdfReference& link : srdf.unchecked_links)
    robot.children.push_back(element("disable_default_collisions", {{"link", link.name}}));
  for (const SrdfLinkPair& pair : srdf.enabled)
    robot.children.push_back(pair_element("enable_collisions", pair));
  for (const SrdfLinkPair& pair : srdf.disabled)
    robot.children.push_back(pair_element("disable_collisions", pair));
  return to_xml(robot);
}

}  // namespace doppel
