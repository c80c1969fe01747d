#include "doppel/ros/foxglove/parameter_name.h"

namespace doppel::foxglove {

std::string parameter_name(std::string_view node, std::string_view name) {
  return std::string(node) + "." + std::string(name);
}

bool split_parameter_name(std::string_view full, std::string& node, std::string& name) {
  const std::size_t dot = full.find('.');
  if (dot == std::string_view::npos || dot == 0 || dot + 1 == full.size()) return false;
  node = full.substr(0, dot);
  name = full.substr(dot + 1);
  if (!node.starts_with('/')) node.insert(0, "/");
  return true;
}

}  // namespace doppel::foxglove
