#include <algorithm>
#include <set>

#include "doppel/description/overlay/detail/overlay.h"

namespace doppel::overlay_detail {

const XmlNode* find_named(const XmlNode& root, std::string_view element, std::string_view name) {
  for (const XmlNode& child : root.children) {
    if (child.is(element) && attribute_of(child, "name") == name) return &child;
  }
  return nullptr;
}

XmlNode* find_named(XmlNode& root, std::string_view element, std::string_view name) {
  return const_cast<XmlNode*>(find_named(std::as_const(root), element, name));
}

std::vector<std::string> names_of(const XmlNode& root, std::string_view element) {
  std::vector<std::string> names;
  for (const XmlNode& child : root.children) {
    if (child.is(element)) names.push_back(attribute_of(child, "name"));
  }
  return names;
}

std::string attribute_of(const XmlNode& node, std::string_view name, std::string_view fallback) {
  const XmlAttribute* attribute = node.find(name);
  return attribute != nullptr ? attribute->value : std::string(fallback);
}

XmlNode* child_of(XmlNode& node, std::string_view element) {
  return const_cast<XmlNode*>(node.first(element));
}

XmlNode make_node(const std::string& element, const SourceLocation& where) {
  XmlNode node;
  node.name = element;
  node.where = where;
  return node;
}

XmlNode& child_or_new(XmlNode& node, const std::string& element, const SourceLocation& where) {
  if (XmlNode* child = child_of(node, element)) return *child;
  return node.children.emplace_back(make_node(element, where));
}

void set_attribute(XmlNode& node, const std::string& name, std::string value, const SourceLocation& where) {
  for (XmlAttribute& attribute : node.attributes) {
    if (attribute.name != name) continue;
    attribute.value = std::move(value);
    return;
  }
  node.attributes.push_back({name, std::move(value), where});
}

std::string link_of(const XmlNode& joint, std::string_view end) {
  const XmlNode* child = joint.first(end);
  return child != nullptr ? attribute_of(*child, "link") : "";
}

const XmlNode* joint_above(const XmlNode& root, std::string_view link) {
  for (const XmlNode& child : root.children) {
    if (child.is("joint") && link_of(child, "child") == link) return &child;
  }
  return nullptr;
}

std::vector<const XmlNode*> joints_below(const XmlNode& root, std::string_view link) {
  std::vector<const XmlNode*> out;
  for (const XmlNode& child : root.children) {
    if (child.is("joint") && link_of(child, "parent") == link) out.push_back(&child);
  }
  return out;
}

std::string root_link(const XmlNode& root) {
  std::set<std::string> children;
  for (const XmlNode& child : root.children) {
    if (child.is("joint")) children.insert(link_of(child, "child"));
  }
  for (const std::string& link : names_of(root, "link")) {
    if (!children.contains(link)) return link;
  }
  return "";
}

}  // namespace doppel::overlay_detail
