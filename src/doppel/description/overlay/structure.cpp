#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/description/overlay/detail/overlay.h"

namespace doppel::overlay_detail {
namespace {

XmlNode element(const char* name, std::initializer_list<std::pair<const char*, std::string>> attributes,
                const SourceLocation& where) {
  XmlNode node = make_node(name, where);
  for (const auto& [key, value] : attributes) node.attributes.push_back({key, value, where});
  return node;
}

XmlNode text_element(const char* name, const std::string& text, const SourceLocation& where) {
  XmlNode node = make_node(name, where);
  XmlNode inside;
  inside.kind = XmlNode::Kind::text;
  inside.text = text;
  inside.where = where;
  node.children.push_back(std::move(inside));
  return node;
}

void replace_value(XmlNode& node, std::string_view attribute, const std::string& from,
                   const std::string& to) {
  for (XmlAttribute& a : node.attributes) {
    if (a.name == attribute && a.value == from) a.value = to;
  }
}

void replace_text(XmlNode& node, const std::string& from, const std::string& to) {
  if (node.content() != from) return;
  for (XmlNode& child : node.children) {
    if (child.kind == XmlNode::Kind::text && child.text.find(from) != std::string::npos)
      child.text.replace(child.text.find(from), from.size(), to);
  }
}

// Elements of Gazebo and its plugins whose text is the name of a joint or of a link.
bool names_joint(const XmlNode& node) {
  static const std::vector<std::string> kNames{"joint",     "joint_name",  "jointName",  "left_joint",
                                               "leftJoint", "right_joint", "rightJoint", "mimicJoint"};
  return std::ranges::find(kNames, node.name) != kNames.end();
}
bool names_link(const XmlNode& node) {
  static const std::vector<std::string> kNames{
      "link",      "link_name",  "linkName",         "body_name",      "bodyName",
      "frameName", "frame_name", "robot_base_frame", "robotBaseFrame", "gz_frame_id"};
  return std::ranges::find(kNames, node.name) != kNames.end();
}

void rename_in_plugins(XmlNode& node, const Rename& action) {
  for (XmlNode& child : node.children) {
    if (child.kind != XmlNode::Kind::element) continue;
    if (action.kind == "joint" ? names_joint(child) : names_link(child))
      replace_text(child, action.from, action.to);
    rename_in_plugins(child, action);
  }
}

void rename_joint_in(XmlNode& element_of_root, const Rename& action) {
  for (XmlNode& child : element_of_root.children) {
    if (child.is("mimic")) replace_value(child, "joint", action.from, action.to);
    if (!child.is("joint")) continue;
    if (element_of_root.is("ros2_control") || element_of_root.is("transmission")) {
      replace_value(child, "name", action.from, action.to);
      for (XmlNode& below : child.children) {  // ros2_control before it read <mimic> of the joint
        if (below.is("param") && attribute_of(below, "name") == "mimic")
          replace_text(below, action.from, action.to);
      }
    }
  }
}

void rename_link_in(XmlNode& element_of_root, const Rename& action) {
  if (!element_of_root.is("joint")) return;
  for (XmlNode& child : element_of_root.children) {
    if (child.is("parent") || child.is("child")) replace_value(child, "link", action.from, action.to);
  }
}

bool refers(const XmlNode& node, const std::string& joint) {
  return std::ranges::any_of(node.children, [&](const XmlNode& child) {
    return child.is("joint") && attribute_of(child, "name") == joint;
  });
}

// Removes a joint with all that only refers to it: its entry in ros2_control, its transmission, its <gazebo>.
void remove_joint(XmlNode& root, const std::string& name, const SourceLocation& where) {
  for (const XmlNode& child : root.children) {
    const XmlNode* mimic = child.is("joint") ? child.first("mimic") : nullptr;
    if (mimic != nullptr && attribute_of(*mimic, "joint") == name) {
      impossible(where,
                 fmt::format("joint '{}' cannot be removed: joint '{}' mimics it", name,
                             attribute_of(child, "name")),
                 fmt::format("remove that mimic first (remove_mimic: {})", attribute_of(child, "name")));
    }
  }
  std::erase_if(root.children, [&](const XmlNode& child) {
    return (child.is("joint") && attribute_of(child, "name") == name) ||
           (child.is("transmission") && refers(child, name)) ||
           (child.is("gazebo") && attribute_of(child, "reference") == name);
  });
  for (XmlNode& block : root.children) {
    if (!block.is("ros2_control")) continue;
    std::erase_if(block.children, [&](const XmlNode& child) {
      return child.is("joint") && attribute_of(child, "name") == name;
    });
  }
}

void remove_link(XmlNode& root, const std::string& name, const SourceLocation& where) {
  const XmlNode* above = joint_above(root, name);
  const auto below = joints_below(root, name);
  const bool leaf = below.empty(), only_a_base = above == nullptr && below.size() == 1;
  if (!leaf && !only_a_base) {
    std::string joints;
    for (const XmlNode* joint : below)
      joints += fmt::format("{}'{}'", joints.empty() ? "" : ", ", attribute_of(*joint, "name"));
    impossible(where,
               fmt::format("link '{}' cannot be removed: {} are attached to it and would be disconnected",
                           name, joints),
               "remove its descendants first, the outermost link before the others");
  }
  if (names_of(root, "link").size() == 1)
    impossible(where, fmt::format("link '{}' cannot be removed: it is the last one", name));
  const XmlNode* joint = leaf ? above : below.front();
  if (joint != nullptr) remove_joint(root, attribute_of(*joint, "name"), where);
  std::erase_if(root.children, [&](const XmlNode& child) {
    return (child.is("link") && attribute_of(child, "name") == name) ||
           (child.is("gazebo") && attribute_of(child, "reference") == name);
  });
}

void remove_lone_joint(XmlNode& root, const std::string& name, const SourceLocation& where) {
  const std::string child = link_of(*find_named(root, "joint", name), "child");
  const auto parents = std::ranges::count_if(root.children, [&](const XmlNode& node) {
    return node.is("joint") && link_of(node, "child") == child;
  });
  if (parents == 1 && find_named(root, "link", child) != nullptr) {
    impossible(
        where,
        fmt::format("joint '{}' cannot be removed alone: link '{}' would be disconnected", name, child),
        fmt::format("remove the link with it (remove_link: {})", child));
  }
  remove_joint(root, name, where);
}

}  // namespace

void attach_to_world(XmlNode& root, const AttachToWorld& action, const SourceLocation& where) {
  if (find_named(root, "link", "world") != nullptr) {
    impossible(where,
               fmt::format("there is already a link 'world', but '{}' is not attached to it", action.link));
  }
  XmlNode joint = element("joint", {{"name", "world_to_" + action.link}, {"type", "fixed"}}, where);
  joint.children.push_back(element("parent", {{"link", "world"}}, where));
  joint.children.push_back(element("child", {{"link", action.link}}, where));
  joint.children.push_back(
      element("origin", {{"xyz", vector_text(action.xyz)}, {"rpy", vector_text(action.rpy)}}, where));
  const auto first = std::ranges::find_if(root.children, [](const XmlNode& n) { return n.is("link"); });
  const auto at = root.children.insert(first, std::move(joint));
  root.children.insert(at, element("link", {{"name", "world"}}, where));
}

void rename(XmlNode& root, const Rename& action) {
  if (action.kind == "robot") {
    replace_value(root, "name", action.from, action.to);
    return;
  }
  for (XmlNode& child : root.children) {
    if (child.is(action.kind)) replace_value(child, "name", action.from, action.to);
    if (action.kind == "joint") rename_joint_in(child, action);
    if (action.kind == "link") rename_link_in(child, action);
    if (child.is("gazebo")) {
      replace_value(child, "reference", action.from, action.to);
      rename_in_plugins(child, action);
    }
  }
}

void add_ros2_control(XmlNode& root, const AddRos2Control& action, const SourceLocation& where) {
  XmlNode block = element("ros2_control", {{"name", action.name}, {"type", "system"}}, where);
  XmlNode hardware = make_node("hardware", where);
  hardware.children.push_back(text_element("plugin", action.plugin, where));
  for (const auto& [name, value] : action.params) {
    XmlNode param = text_element("param", value, where);
    param.attributes.push_back({"name", name, where});
    hardware.children.push_back(std::move(param));
  }
  block.children.push_back(std::move(hardware));
  for (const std::string& name : action.joints) {
    if (find_named(root, "joint", name) == nullptr) {
      impossible(where,
                 fmt::format("the ros2_control block '{}' drives a joint '{}' that does not exist{}",
                             action.name, name, did_you_mean(name, names_of(root, "joint"))),
                 "correct its list of joints");
    }
    XmlNode joint = element("joint", {{"name", name}}, where);
    for (const std::string& interface : action.command_interfaces)
      joint.children.push_back(element("command_interface", {{"name", interface}}, where));
    for (const std::string& interface : action.state_interfaces) {
      XmlNode state = element("state_interface", {{"name", interface}}, where);
      for (const auto& [of, value] : action.initial_values) {
        if (of != name || interface != "position") continue;
        XmlNode initial = text_element("param", number_text(value), where);
        initial.attributes.push_back({"name", "initial_value", where});
        state.children.push_back(std::move(initial));
      }
      joint.children.push_back(std::move(state));
    }
    block.children.push_back(std::move(joint));
  }
  root.children.push_back(std::move(block));
}

void remove(XmlNode& root, const Remove& action, const SourceLocation& where) {
  if (action.kind == "link") return remove_link(root, action.name, where);
  if (action.kind == "joint") return remove_lone_joint(root, action.name, where);
  const std::string kind = target_kind(action);
  if (kind != action.kind) {
    XmlNode* target = find_named(root, kind, action.name);
    std::erase_if(target->children, [&](const XmlNode& child) { return child.is(action.kind); });
    return;
  }
  const char* key = action.kind == "gazebo" ? "reference" : "name";
  std::erase_if(root.children, [&](const XmlNode& child) {
    return child.is(action.kind) && attribute_of(child, key) == action.name;
  });
}

}  // namespace doppel::overlay_detail
