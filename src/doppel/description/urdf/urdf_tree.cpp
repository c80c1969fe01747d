// The checks on the tree that joints make of links.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/description/urdf/urdf_parser.h"

namespace doppel {
namespace {

std::string quoted_list(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += fmt::format("{}'{}'", out.empty() ? "" : ", ", name);
  return out;
}

template <class Element>
void check_unique(const std::vector<Element>& elements, const char* what, Diagnostics& diagnostics) {
  std::map<std::string, const Element*> seen;
  for (const Element& element : elements) {
    const auto [first, fresh] = seen.emplace(element.name, &element);
    if (fresh) continue;
    diagnostics.error("urdf.duplicate_name", element.source,
                      fmt::format("there are two {}s named '{}'; the other is at {}", what, element.name,
                                  first->second->source.str()),
                      "rename one of them");
  }
}

bool check_ends(const RobotDescription& robot, const std::vector<std::string>& links,
                Diagnostics& diagnostics) {
  bool good = true;
  for (const Joint& joint : robot.joints) {
    for (const std::string* end : {&joint.parent, &joint.child}) {
      if (end->empty() || robot.find_link(*end) != nullptr) continue;
      good = false;
      diagnostics.error("urdf.unknown_link", joint.source,
                        fmt::format("the joint '{}' refers to a link '{}', which the robot does not have{}",
                                    joint.name, *end, did_you_mean(*end, links)));
    }
  }
  return good;
}

void check_roots(const RobotDescription& robot, Diagnostics& diagnostics) {
  std::map<std::string, const Joint*> parent_of;
  for (const Joint& joint : robot.joints) {
    const auto [first, fresh] = parent_of.emplace(joint.child, &joint);
    if (fresh) continue;
    diagnostics.error(
        "urdf.two_parents", joint.source,
        fmt::format("the link '{}' is the child of both '{}' and '{}' (at {}); a URDF is a tree", joint.child,
                    joint.name, first->second->name, first->second->source.place()),
        "remove one of the joints; a closed kinematic chain cannot be described in URDF");
  }
  std::vector<std::string> roots;
  std::set<std::string> in_loop;
  for (const Link& link : robot.links) {
    if (!parent_of.contains(link.name)) roots.push_back(link.name);
    std::string at = link.name;
    std::set<std::string> path;
    while (parent_of.contains(at) && path.insert(at).second) at = parent_of[at]->parent;
    if (parent_of.contains(at)) in_loop.insert(at);
  }
  if (!in_loop.empty()) {
    const std::vector<std::string> names(in_loop.begin(), in_loop.end());
    diagnostics.error(
        "urdf.loop", parent_of[names.front()]->source,
        fmt::format("the joints form a loop through the links {}; a URDF is a tree", quoted_list(names)),
        "reverse one of the joints, or remove it");
  } else if (roots.size() > 1) {
    diagnostics.error("urdf.two_roots", robot.find_link(roots[1])->source,
                      fmt::format("the robot has {} root links, {}: links without a parent joint",
                                  roots.size(), quoted_list(roots)),
                      "connect them with a <joint type=\"fixed\">, or remove the unused ones");
  }
}

// The reason why a <mimic> has no effect, with its rule.
std::pair<const char*, std::string> mimic_fault(const RobotDescription& robot, const Joint& joint,
                                                const std::vector<std::string>& names) {
  const Joint* const leader = robot.find_joint(joint.mimic->joint);
  if (leader == nullptr) {
    return {"urdf.mimic_unknown",
            fmt::format("'{}' mimics '{}', which is not a joint of this robot{}", joint.name,
                        joint.mimic->joint, did_you_mean(joint.mimic->joint, names))};
  }
  if (!is_scalar(joint) || !is_scalar(*leader)) {
    return {"urdf.mimic_not_scalar",
            fmt::format("'{}' mimics '{}', but '{}' is not a revolute, continuous or prismatic joint",
                        joint.name, leader->name, is_scalar(joint) ? leader->name : joint.name)};
  }
  return {"urdf.mimic_loop",
          fmt::format("'{}' mimics itself{}", joint.name, leader == &joint ? "" : " through others")};
}

void check_mimics(const RobotDescription& robot, Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (const Joint& joint : robot.joints) names.push_back(joint.name);
  for (const Joint& joint : robot.joints) {
    if (!joint.mimic || leader_of(robot, joint) != nullptr) continue;
    const auto [rule, why] = mimic_fault(robot, joint, names);
    diagnostics.warning(rule, joint.mimic->source,
                        fmt::format("{}{} {}", why, why.ends_with('?') ? "" : ";",
                                    is_scalar(joint) ? "it moves independently" : "the <mimic> is ignored"),
                        "let it mimic a revolute, continuous or prismatic joint that does not mimic it, or "
                        "remove the <mimic>");
  }
}

}  // namespace

void check_tree(const RobotDescription& robot, Diagnostics& diagnostics) {
  if (robot.links.empty()) return;
  check_unique(robot.links, "link", diagnostics);
  check_unique(robot.joints, "joint", diagnostics);
  std::vector<std::string> links;
  for (const Link& link : robot.links) links.push_back(link.name);
  if (check_ends(robot, links, diagnostics)) check_roots(robot, diagnostics);
  check_mimics(robot, diagnostics);
}

}  // namespace doppel
