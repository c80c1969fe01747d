#include "doppel/review/conversion/srdf.h"

#include "doppel/base/math/decimals.h"
#include "doppel/base/xml/element.h"

namespace doppel {
namespace {

XmlNode group_of(const Model& model, const PlanningGroup& group) {
  XmlNode node = element("group", {{"name", group.name}});
  if (group.base_link >= 0) {
    node.children.push_back(element("chain", {{"base_link", model.links[group.base_link].name},
                                              {"tip_link", model.links[group.tip_link].name}}));
    return node;
  }
  for (const int joint : group.joints)
    node.children.push_back(element("joint", {{"name", model.joints[joint].name}}));
  return node;
}

// Zero, or the limit nearest to it.
XmlNode home_of(const Model& model, const PlanningGroup& group) {
  const Eigen::VectorXd q = model.neutral();
  XmlNode node = element("group_state", {{"name", "home"}, {"group", group.name}});
  for (const int index : group.joints) {
    const ModelJoint& joint = model.joints[index];
    if (joint.mimics()) continue;
    node.children.push_back(element("joint", {{"name", joint.name}, {"value", decimal(q[joint.q])}}));
  }
  return node;
}

XmlNode effector_of(const Model& model, const std::vector<PlanningGroup>& groups,
                    const PlanningGroup& group) {
  XmlNode node = element("end_effector", {{"name", group.name + "_ee"},
                                          {"parent_link", model.links[group.parent_link].name},
                                          {"group", group.name}});
  if (group.parent_group >= 0)
    node.attributes.push_back({"parent_group", groups[group.parent_group].name, {}});
  return node;
}

}  // namespace

std::string to_srdf(const Model& model, const std::vector<PlanningGroup>& groups,
                    const std::vector<DisabledPair>& disabled) {
  XmlNode robot = element("robot", {{"name", model.name}});
  for (const PlanningGroup& group : groups) robot.children.push_back(group_of(model, group));
  for (const PlanningGroup& group : groups) robot.children.push_back(home_of(model, group));
  for (const PlanningGroup& group : groups) {
    if (group.gripper && group.parent_link >= 0) robot.children.push_back(effector_of(model, groups, group));
  }
  if (model.links[0].name != "world") {
    robot.children.push_back(element("virtual_joint", {{"name", "virtual_joint"},
                                                       {"type", "fixed"},
                                                       {"parent_frame", "world"},
                                                       {"child_link", model.links[0].name}}));
  }
  for (const ModelJoint& joint : model.joints) {
    if (joint.mimics()) robot.children.push_back(element("passive_joint", {{"name", joint.name}}));
  }
  for (const DisabledPair& pair : disabled) {
    robot.children.push_back(
        element("disable_collisions", {{"link1", model.links[pair.link_a].name},
                                       {"link2", model.links[pair.link_b].name},
                                       {"reason", std::string(to_string(pair.reason))}}));
  }
  return to_xml(robot);
}

}  // namespace doppel
