#include "doppel/review/conversion/detail/world_lost.h"

#include <fmt/format.h>

#include "doppel/base/xml/xml.h"

namespace doppel {

void WorldLosses::lose(const SourceLocation& where, const std::string& what, const std::string& fix) {
  diagnostics_.warning("world.lost", where, fmt::format("{} cannot be written to {}", what, format_), fix);
}

void WorldLosses::lose_sensor(const SdfModel& model, const SdfSensor& sensor) {
  lose(sensor.source, fmt::format("the sensor '{}' of '{}'", sensor.name, model.name));
}

void WorldLosses::lose_sensors_and_plugins(const SdfModel& model) {
  for (const SdfSensor& sensor : model.sensors) lose_sensor(model, sensor);
  for (const GazeboExtension& extension : model.description->gazebo) {
    for (const GazeboPlugin& plugin : extension.plugins)
      lose(plugin.source, fmt::format("the plugin '{}' of '{}'", plugin.name, model.name));
    if (extension.xml.empty()) continue;
    for (const XmlNode& child : parse_xml(extension.xml, "<gazebo>").children) {
      const XmlAttribute* const name = child.find("name");
      if (child.is("sensor"))
        lose(extension.source,
             fmt::format("the sensor '{}' of '{}'", name == nullptr ? "" : name->value, model.name));
    }
  }
}

void WorldLosses::lose_plugins(const SdfWorld& world) {
  for (const GazeboPlugin& plugin : world.plugins)
    lose(plugin.source, fmt::format("the plugin '{}'", plugin.name));
}

void WorldLosses::lose_lights(const SdfWorld& world) {
  for (const Light& light : world.settings.lights)
    lose(light.source, fmt::format("the light '{}'", light.name));
}

void WorldLosses::lose_environment(const SdfWorld& world) {
  if (world.settings.environment) lose(world.settings.environment->source, "the <scene>");
}

}  // namespace doppel
