#include "doppel/review/comparison/comparison.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "doppel/review/comparison/detail/comparison.h"

namespace doppel {
namespace {

using comparison::Changes;

double total_mass(const RobotDescription& robot) {
  double mass = 0;
  for (const Link& link : robot.links) mass += link.inertial ? link.inertial->mass : 0.0;
  return mass;
}

std::string root_of(const RobotDescription& robot) {
  for (const Link& link : robot.links) {
    const bool child = std::any_of(robot.joints.begin(), robot.joints.end(),
                                   [&link](const Joint& joint) { return joint.child == link.name; });
    if (!child) return link.name;
  }
  return "none";
}

void compare_robots(const RobotDescription& a, const RobotDescription& b, std::vector<Change>& out) {
  Changes changes(out, "robot", b.name);
  changes.text("name", a.name, b.name);
  changes.text("root", root_of(a), root_of(b));
  changes.number("links", static_cast<double>(a.links.size()), static_cast<double>(b.links.size()), 1, "");
  changes.number("joints", static_cast<double>(a.joints.size()), static_cast<double>(b.joints.size()), 1, "");
  changes.number("mass", total_mass(a), total_mass(b), 1e3, "g");
}

// Names of `a` that have other names in `b`. Two unmatched elements with equal properties are the same one.
using Renames = std::map<std::string, std::string>;

template <class Element, class Alike>
Renames find_renames(const std::vector<Element>& a, const std::vector<Element>& b, const Alike& alike) {
  const auto has = [](const std::vector<Element>& all, const std::string& name) {
    return std::any_of(all.begin(), all.end(), [&name](const Element& e) { return e.name == name; });
  };
  Renames out;
  for (const Element& old : a) {
    if (has(b, old.name)) continue;
    const Element* partner = nullptr;
    int partners = 0;
    for (const Element& fresh : b) {
      if (has(a, fresh.name) || !alike(old, fresh)) continue;
      partner = &fresh;
      ++partners;
    }
    if (partners == 1) out.emplace(old.name, partner->name);
  }
  return out;
}

bool nothing_changed(const Link& a, const Link& b) {
  std::vector<Change> changes;
  comparison::compare_link(a, b, changes);
  return changes.empty();
}

bool alike(const Link& a, const Link& b) {
  const bool says_something = a.inertial || !a.visuals.empty();
  return says_something && nothing_changed(a, b);
}

std::string renamed(const std::string& name, const Renames& renames) {
  const auto found = renames.find(name);
  return found == renames.end() ? name : found->second;
}

// `a` with the names of `b`, so that a new name is one change and not one for each mention.
RobotDescription with_names(RobotDescription a, const Renames& links, const Renames& joints) {
  for (Link& link : a.links) link.name = renamed(link.name, links);
  for (Joint& joint : a.joints) {
    joint.name = renamed(joint.name, joints);
    joint.parent = renamed(joint.parent, links);
    joint.child = renamed(joint.child, links);
    if (joint.mimic) joint.mimic->joint = renamed(joint.mimic->joint, joints);
  }
  for (HardwareDescription& hardware : a.hardware) {
    for (HardwareJointDescription& joint : hardware.joints) joint.name = renamed(joint.name, joints);
  }
  return a;
}

std::string joint_summary(const Joint& joint) {
  return fmt::format("{} -> {}", joint.parent, joint.child);
}

template <class Element, class Compare, class Summary>
void compare_lists(const std::vector<Element>& a, const std::vector<Element>& b, const char* subject,
                   const Renames& renames, const Compare& compare_one, const Summary& summary,
                   std::vector<Change>& out) {
  const auto find = [](const std::vector<Element>& all, const std::string& name) -> const Element* {
    const auto at =
        std::find_if(all.begin(), all.end(), [&name](const Element& e) { return e.name == name; });
    return at == all.end() ? nullptr : &*at;
  };
  for (const Element& fresh : b) {
    const Element* old = find(a, fresh.name);
    if (old == nullptr) {
      out.push_back({Change::Kind::added, subject, fresh.name, "", "", summary(fresh), ""});
      continue;
    }
    const auto before = std::find_if(renames.begin(), renames.end(),
                                     [&fresh](const auto& pair) { return pair.second == fresh.name; });
    if (before != renames.end())
      out.push_back({Change::Kind::renamed, subject, fresh.name, "name", before->first, fresh.name, ""});
    compare_one(*old, fresh, out);
  }
  for (const Element& old : a) {
    if (find(b, old.name) == nullptr)
      out.push_back({Change::Kind::removed, subject, old.name, "", summary(old), "", ""});
  }
}

const char* kind_name(Change::Kind kind) {
  switch (kind) {
    case Change::Kind::added:
      return "added";
    case Change::Kind::removed:
      return "removed";
    case Change::Kind::renamed:
      return "renamed";
    case Change::Kind::changed:
      return "changed";
  }
  return "changed";
}

}  // namespace

std::vector<Change> compare(const RobotDescription& original, const RobotDescription& b) {
  const Renames links = find_renames(original.links, b.links, alike);
  const Renames joints =
      find_renames(original.joints, b.joints, [&links](const Joint& old, const Joint& fresh) {
        return old.type == fresh.type && renamed(old.child, links) == fresh.child;
      });
  const RobotDescription a = with_names(original, links, joints);
  std::vector<Change> out;
  compare_robots(a, b, out);
  compare_lists(a.joints, b.joints, "joint", joints, comparison::compare_joint, joint_summary, out);
  const auto link_summary = [](const Link& link) {
    return link.inertial ? Changes::shown(link.inertial->mass * 1e3, "g") : std::string("a frame");
  };
  compare_lists(a.links, b.links, "link", links, comparison::compare_link, link_summary, out);
  comparison::compare_control(a, b, out);
  return out;
}

std::string to_json(const std::vector<Change>& changes) {
  nlohmann::ordered_json out;
  out["version"] = 1;
  out["equal"] = changes.empty();
  out["changes"] = nlohmann::ordered_json::array();
  for (const Change& change : changes) {
    out["changes"].push_back({{"kind", kind_name(change.kind)},
                              {"subject", change.subject},
                              {"name", change.name},
                              {"aspect", change.aspect},
                              {"from", change.from},
                              {"to", change.to},
                              {"meaning", change.meaning}});
  }
  return out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace doppel
