#include "doppel/sensors/label_plugin.h"

#include <charconv>

#include "doppel/description/simulator_plugins.h"
#include "doppel/xml/xml.h"

namespace doppel {
namespace {

constexpr unsigned kMostLabel = 255;

std::optional<std::uint16_t> label_in(const XmlNode& plugin) {
  const XmlNode* const label = plugin.first("label");
  if (label == nullptr) return std::nullopt;
  const std::string text = label->content();
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value > kMostLabel) return std::nullopt;
  return static_cast<std::uint16_t>(value);
}

}  // namespace

std::optional<std::uint16_t> label_of(const RobotDescription& robot) {
  for (const GazeboExtension& gazebo : robot.gazebo) {
    if (!gazebo.reference.empty() || !gazebo.node) continue;
    for (const XmlNode& child : gazebo.node->children) {
      if (!child.is("plugin")) continue;
      const XmlAttribute *filename = child.find("filename"), *name = child.find("name");
      if (is_label_plugin(filename != nullptr ? filename->value : "", name != nullptr ? name->value : ""))
        return label_in(child);
    }
  }
  return std::nullopt;
}

}  // namespace doppel
