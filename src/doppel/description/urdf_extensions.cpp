// What other tools have added to URDF: <ros2_control>, <gazebo>, <transmission>.
#include <fmt/format.h>

#include "doppel/description/urdf_parser.h"
#include "doppel/description/urdf_reader.h"

namespace doppel {
namespace {

using Params = std::vector<std::pair<std::string, std::string>>;

Params read_params(const XmlNode& node) {
  Params out;
  for (const XmlNode& child : node.children) {
    if (child.is("param")) out.emplace_back(UrdfReader::optional(child, "name"), child.content());
  }
  return out;
}

HardwareInterfaceDescription read_interface(const XmlNode& node, UrdfReader& read) {
  HardwareInterfaceDescription out;
  out.name = read.required(node, "name");
  out.source = node.where;
  for (const XmlNode& child : node.children) {
    if (!child.is("param")) continue;
    const std::string name = UrdfReader::optional(child, "name");
    if (name == "min")
      out.min = read.number_inside(child);
    else if (name == "max")
      out.max = read.number_inside(child);
    else if (name == "initial_value")
      out.initial_value = read.number_inside(child);
    else
      out.params.emplace_back(name, child.content());
  }
  return out;
}

HardwareJointDescription read_hardware_joint(const XmlNode& node, UrdfReader& read) {
  HardwareJointDescription out;
  out.name = read.required(node, "name");
  out.source = node.where;
  out.params = read_params(node);
  for (const XmlNode& child : node.children) {
    if (child.is("command_interface")) out.command_interfaces.push_back(read_interface(child, read));
    if (child.is("state_interface")) out.state_interfaces.push_back(read_interface(child, read));
  }
  return out;
}

GazeboPlugin read_plugin(const XmlNode& node, const std::filesystem::path& base,
                         const PackageResolver& resolver) {
  GazeboPlugin out{UrdfReader::optional(node, "filename"),
                   UrdfReader::optional(node, "name"),
                   {},
                   to_xml(node),
                   node.where};
  for (const XmlNode& child : node.children) {
    if (!child.is("parameters")) continue;
    const std::string text = child.content();
    const auto found = resolver.resolve(text, base);
    out.parameter_files.push_back(found.path.empty() ? text : found.path.string());
  }
  return out;
}

std::optional<bool> read_bool(const XmlNode& node) {
  const std::string text = node.content();
  if (text == "true" || text == "1") return true;
  if (text == "false" || text == "0") return false;
  return std::nullopt;
}

}  // namespace

HardwareDescription read_hardware(const XmlNode& node, Diagnostics& diagnostics) {
  UrdfReader read(diagnostics);
  HardwareDescription out;
  out.name = read.required(node, "name");
  out.type = UrdfReader::optional(node, "type");
  out.source = out.plugin_source = node.where;
  for (const XmlNode& child : node.children) {
    if (child.is("hardware")) {
      out.params = read_params(child);
      if (const XmlNode* plugin = child.first("plugin")) {
        out.plugin = plugin->content();
        out.plugin_source = plugin->where;
      }
    }
    if (child.is("joint")) out.joints.push_back(read_hardware_joint(child, read));
    if (child.is("sensor")) out.sensors.push_back(read_hardware_joint(child, read));
    if (child.is("gpio")) out.gpios.push_back(read_hardware_joint(child, read));
  }
  return out;
}

GazeboExtension read_gazebo(const XmlNode& node, const std::filesystem::path& base,
                            const PackageResolver& resolver, Diagnostics& diagnostics) {
  UrdfReader read(diagnostics);
  GazeboExtension out;
  out.reference = UrdfReader::optional(node, "reference");
  out.xml = to_xml(node);
  out.source = node.where;
  for (const XmlNode& child : node.children) {
    if (child.is("plugin")) out.plugins.push_back(read_plugin(child, base, resolver));
    if (child.is("mu1")) out.mu1 = read.number_inside(child);
    if (child.is("mu2")) out.mu2 = read.number_inside(child);
    if (child.is("kp")) out.kp = read.number_inside(child);
    if (child.is("kd")) out.kd = read.number_inside(child);
    if (child.is("selfCollide") || child.is("self_collide")) out.self_collide = read_bool(child);
    if (child.is("gravity")) out.gravity = read_bool(child);
    if (child.is("material")) out.material = child.content();
  }
  return out;
}

Transmission read_transmission(const XmlNode& node, Diagnostics& diagnostics) {
  UrdfReader read(diagnostics);
  Transmission out;
  out.name = UrdfReader::optional(node, "name");
  out.type = UrdfReader::optional(node, "type");
  out.source = node.where;
  if (const XmlNode* type = node.first("type")) out.type = type->content();
  for (const XmlNode& child : node.children) {
    if (!child.is("joint") && !child.is("actuator")) continue;
    Transmission::Element element{UrdfReader::optional(child, "name"), "", {}, child.where};
    if (const XmlNode* interface = child.first("hardwareInterface"))
      element.hardware_interface = interface->content();
    if (const XmlNode* reduction = child.first("mechanicalReduction"))
      element.mechanical_reduction = read.number_inside(*reduction);
    (child.is("joint") ? out.joints : out.actuators).push_back(std::move(element));
  }
  return out;
}

}  // namespace doppel
