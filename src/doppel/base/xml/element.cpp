#include "doppel/base/xml/element.h"

namespace doppel {

XmlNode element(std::string name, XmlAttributes attributes, std::vector<XmlNode> children) {
  XmlNode node;
  node.name = std::move(name);
  for (auto& [key, value] : attributes) add_attribute(node, std::move(key), std::move(value));
  node.children = std::move(children);
  return node;
}

XmlNode text_element(std::string name, std::string text, XmlAttributes attributes) {
  XmlNode inside;
  inside.kind = XmlNode::Kind::text;
  inside.text = std::move(text);
  return element(std::move(name), std::move(attributes), {std::move(inside)});
}

XmlNode comment(std::string text) {
  XmlNode node;
  node.kind = XmlNode::Kind::comment;
  // Two hyphens would end it.
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at))
    text[at + 1] = ' ';
  node.text = " " + text + " ";
  return node;
}

void add_attribute(XmlNode& node, std::string name, std::string value) {
  node.attributes.push_back({std::move(name), std::move(value), {}});
}

std::string truth(bool value) {
  return value ? "true" : "false";
}

}  // namespace doppel
