#include "doppel/conversion/detail/document.h"

#include <fmt/format.h>

#include <algorithm>

namespace doppel {

XmlNode element(std::string name, XmlAttributes attributes, std::vector<XmlNode> children) {
  XmlNode node;
  node.name = std::move(name);
  for (auto& [key, value] : attributes) node.attributes.push_back({std::move(key), std::move(value), {}});
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

std::string decimal(double value) {
  return value == 0 ? "0" : fmt::format("{}", value);
}

std::string decimals(const Eigen::Vector3d& v) {
  return decimal(v.x()) + " " + decimal(v.y()) + " " + decimal(v.z());
}

std::string truth(bool value) {
  return value ? "true" : "false";
}

std::string unique_name(const std::string& wanted, std::vector<std::string>& taken) {
  std::string name = wanted;
  for (int i = 2; std::find(taken.begin(), taken.end(), name) != taken.end(); ++i)
    name = fmt::format("{}_{}", wanted, i);
  taken.push_back(name);
  return name;
}

}  // namespace doppel
