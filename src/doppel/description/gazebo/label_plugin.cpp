#include "doppel/description/gazebo/label_plugin.h"

#include <fmt/format.h>

#include <charconv>

#include "doppel/base/xml/xml.h"
#include "doppel/description/gazebo/simulator_plugins.h"

namespace doppel {
namespace {

constexpr unsigned kMostLabel = 255;

std::string attribute_of(const XmlNode& node, const char* name) {
  const XmlAttribute* const found = node.find(name);
  return found == nullptr ? "" : found->value;
}

std::optional<std::uint16_t> label_in(const XmlNode& plugin, Diagnostics& diagnostics) {
  const XmlNode* const label = plugin.first("label");
  const std::string text = label == nullptr ? "" : label->content();
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value > kMostLabel) {
    diagnostics.warning("sensor.value", plugin.where,
                        fmt::format("the <label> '{}' is not a number from 0 to {}; the plugin has no effect",
                                    text, kMostLabel));
    return std::nullopt;
  }
  return static_cast<std::uint16_t>(value);
}

}  // namespace

VisualLabels::VisualLabels(const RobotDescription& robot, Diagnostics& diagnostics) {
  const auto read = [&](const XmlNode& parent, Place place, const std::string& link,
                        const std::string& visual) {
    for (const XmlNode& child : parent.children) {
      if (!child.is("plugin") ||
          !is_label_plugin(attribute_of(child, "filename"), attribute_of(child, "name")))
        continue;
      if (const auto value = label_in(child, diagnostics)) labels_.push_back({place, link, visual, *value});
    }
  };
  for (const GazeboExtension& gazebo : robot.gazebo) {
    if (!gazebo.node) continue;
    read(*gazebo.node, gazebo.reference.empty() ? Place::model : Place::link, gazebo.reference, "");
    for (const XmlNode& child : gazebo.node->children) {
      if (gazebo.reference.empty() || !child.is("visual")) continue;
      const std::string name = attribute_of(child, "name");
      read(child, name.empty() ? Place::visuals : Place::visual, gazebo.reference, name);
    }
  }
}

std::vector<std::optional<std::uint16_t>> VisualLabels::of(const Link& link) const {
  std::vector<std::optional<std::uint16_t>> out;
  for (const Visual& visual : link.visuals) {
    const Written* best = nullptr;
    for (const Written& label : labels_) {
      const bool applies =
          label.place == Place::model ||
          (label.link == link.name && (label.place != Place::visual || label.visual == visual.name));
      if (applies && (best == nullptr || label.place > best->place)) best = &label;
    }
    out.push_back(best == nullptr || best->value == 0 ? std::nullopt : std::optional(best->value));
  }
  return out;
}

}  // namespace doppel
