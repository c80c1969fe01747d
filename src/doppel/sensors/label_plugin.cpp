#include "doppel/sensors/label_plugin.h"

#include <fmt/format.h>

#include <charconv>

#include "doppel/description/simulator_plugins.h"
#include "doppel/xml/xml.h"

namespace doppel {
namespace {

constexpr unsigned kMostLabel = 255;

std::optional<std::uint16_t> label_in(const XmlNode& plugin, Diagnostics& diagnostics) {
  const XmlNode* const label = plugin.first("label");
  const std::string text = label == nullptr ? "" : label->content();
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value > kMostLabel) {
    diagnostics.warning(
        "sensor.value", plugin.where,
        fmt::format("the <label> '{}' is not a number from 0 to {}; the model has none", text, kMostLabel));
    return std::nullopt;
  }
  return value == 0 ? std::nullopt : std::optional(static_cast<std::uint16_t>(value));
}

}  // namespace

std::optional<std::uint16_t> label_of(const RobotDescription& robot, Diagnostics& diagnostics) {
  for (const GazeboExtension& gazebo : robot.gazebo) {
    if (!gazebo.reference.empty() || !gazebo.node) continue;
    for (const XmlNode& child : gazebo.node->children) {
      if (!child.is("plugin")) continue;
      const XmlAttribute *filename = child.find("filename"), *name = child.find("name");
      if (is_label_plugin(filename != nullptr ? filename->value : "", name != nullptr ? name->value : ""))
        return label_in(child, diagnostics);
    }
  }
  return std::nullopt;
}

}  // namespace doppel
