// Extensions of URDF by other tools: <ros2_control>, <gazebo>, <transmission>.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "doppel/base/packages/find_expression.h"
#include "doppel/description/urdf/contact_surface.h"
#include "doppel/description/urdf/urdf_parser.h"
#include "doppel/description/urdf/urdf_reader.h"

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

// ros2_control writes the values of a bool as words; on its interfaces they are 1 and 0.
std::optional<double> read_initial_value(const XmlNode& node, const std::string& data_type,
                                         UrdfReader& read) {
  const std::string text = node.content();
  if (data_type == "bool" && (text == "true" || text == "True")) return 1.0;
  if (data_type == "bool" && (text == "false" || text == "False")) return 0.0;
  return read.number_of(node, text);
}

HardwareInterfaceDescription read_interface(const XmlNode& node, Diagnostics& diagnostics) {
  HardwareInterfaceDescription out;
  out.name = UrdfReader::optional(node, "name");
  out.source = node.where;
  const std::string data_type = UrdfReader::optional(node, "data_type");
  UrdfReader read(diagnostics, "urdf.optional_value", "the interface is read without it");
  for (const XmlNode& child : node.children) {
    if (!child.is("param")) continue;
    const std::string name = UrdfReader::optional(child, "name");
    if (name == "min")
      out.min = read.number_inside(child);
    else if (name == "max")
      out.max = read.number_inside(child);
    else if (name == "initial_value")
      out.initial_value = read_initial_value(child, data_type, read);
    else
      out.params.emplace_back(name, child.content());
  }
  return out;
}

// An interface without a name cannot be claimed by a controller.
bool named(const XmlNode& node, Diagnostics& diagnostics) {
  UrdfReader read(diagnostics, "urdf.optional_value", fmt::format("this <{}> is ignored", node.name));
  return !read.required(node, "name").empty();
}

HardwareJointDescription read_hardware_joint(const XmlNode& node, Diagnostics& diagnostics) {
  HardwareJointDescription out;
  out.name = UrdfReader::optional(node, "name");
  out.source = node.where;
  out.params = read_params(node);
  for (const XmlNode& child : node.children) {
    const bool command = child.is("command_interface");
    if ((!command && !child.is("state_interface")) || !named(child, diagnostics)) continue;
    (command ? out.command_interfaces : out.state_interfaces).push_back(read_interface(child, diagnostics));
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
    const std::string text = with_found_package(child.content(), resolver);
    const auto found = resolver.resolve(text, base);
    out.parameter_files.push_back(found.path.empty() ? text : found.path.string());
  }
  return out;
}

// In sdformat the attribute has priority over the text: <mu1 value="0.8"/>, <mu1>0.8</mu1>.
std::string value_of(const XmlNode& node) {
  const XmlAttribute* attribute = node.find("value");
  return attribute != nullptr ? attribute->value : node.content();
}

// Every word but sdformat's three for true is false.
bool read_bool(const XmlNode& node, Diagnostics& diagnostics) {
  std::string text = value_of(node);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array kTrue{"true", "yes", "1"}, kFalse{"false", "no", "0"};
  if (std::find(kTrue.begin(), kTrue.end(), text) != kTrue.end()) return true;
  if (std::find(kFalse.begin(), kFalse.end(), text) == kFalse.end()) {
    diagnostics.warning(
        "urdf.optional_value", node.where,
        fmt::format("<{}> is '{}', which is neither true nor false; it is read as false, as in Gazebo",
                    node.name, text),
        "write true or false");
  }
  return false;
}

// nullopt: three numbers that are 0, which is Gazebo's word for no direction, or no three numbers.
std::optional<Eigen::Vector3d> read_direction(const XmlNode& node, UrdfReader& read) {
  const auto direction = read.vector_of<3>(node, value_of(node));
  return direction && direction->norm() > 0 ? direction : std::nullopt;
}

// <collision><surface><friction> of SDF, which sdformat copies to each collision of the link.
void read_surface(const XmlNode& collision, UrdfReader& read, ContactSurface& out) {
  const XmlNode* const surface = collision.first("surface");
  const XmlNode* const friction = surface == nullptr ? nullptr : surface->first("friction");
  if (friction == nullptr) return;
  const ElementNumbers numbers{
      [&read](const XmlNode& parent, std::string_view name) {
        const XmlNode* const child = parent.first(name);
        return child == nullptr ? std::nullopt : read.number_inside(*child);
      },
      [&read](const XmlNode& parent, std::string_view name) -> std::optional<Eigen::Vector3d> {
        const XmlNode* const child = parent.first(name);
        return child == nullptr ? std::nullopt : read.vector_of<3>(*child, child->content());
      }};
  read_friction(*friction, numbers, out);
}

std::string read_contact_shape(const XmlNode& node, UrdfReader& read) {
  const std::string shape = value_of(node);
  if (shape == "cylinder" || shape == "hull") return shape;
  read.fault("urdf.optional_value", node.where,
             fmt::format("<doppel:contact> is '{}', which is neither 'cylinder' nor 'hull'", shape),
             "write 'cylinder' or 'hull', or omit it: a wheel then rolls on its exact round shape");
  return "";
}

}  // namespace

namespace {

// rw_rate, is_async and thread_priority; the newer form of the last is <properties><async thread_priority/>.
void read_scheduling(const XmlNode& node, HardwareDescription& out, Diagnostics& diagnostics) {
  UrdfReader read(diagnostics, "urdf.optional_value",
                  "the rate and the thread of the controller manager are used");
  const XmlNode* properties = node.first("properties");
  const XmlNode* async = properties == nullptr ? nullptr : properties->first("async");
  out.rw_rate = read.number(node, "rw_rate");
  if (out.rw_rate && !(*out.rw_rate > 0)) {
    read.fault("urdf.optional_value", node.where,
               fmt::format("the rw_rate of <ros2_control> '{}' is {:g} Hz", out.name, *out.rw_rate),
               "give a rate above 0 Hz, or omit it");
    out.rw_rate.reset();
  }
  const std::string is_async = UrdfReader::optional(node, "is_async");
  out.is_async = is_async == "true" || is_async == "True" || is_async == "1";
  for (const XmlNode* from : {&node, async}) {
    if (from == nullptr || from->find("thread_priority") == nullptr) continue;
    if (const auto priority = read.number(*from, "thread_priority"))
      out.thread_priority = static_cast<int>(*priority);
  }
}

}  // namespace

HardwareDescription read_hardware(const XmlNode& node, Diagnostics& diagnostics) {
  HardwareDescription out;
  out.name = UrdfReader::optional(node, "name");
  out.type = UrdfReader::optional(node, "type");
  out.source = out.plugin_source = node.where;
  read_scheduling(node, out, diagnostics);
  for (const XmlNode& child : node.children) {
    if (child.is("hardware")) {
      out.params = read_params(child);
      if (const XmlNode* group = child.first("group")) out.group = group->content();
      if (const XmlNode* plugin = child.first("plugin")) {
        out.plugin = plugin->content();
        out.plugin_source = plugin->where;
      }
    }
    std::vector<HardwareJointDescription>* const parts = child.is("joint")    ? &out.joints
                                                         : child.is("sensor") ? &out.sensors
                                                         : child.is("gpio")   ? &out.gpios
                                                                              : nullptr;
    if (parts != nullptr && named(child, diagnostics))
      parts->push_back(read_hardware_joint(child, diagnostics));
  }
  return out;
}

GazeboExtension read_gazebo(const XmlNode& node, const std::filesystem::path& base,
                            const PackageResolver& resolver, Diagnostics& diagnostics) {
  UrdfReader read(diagnostics, "urdf.optional_value", "it has no effect");
  GazeboExtension out;
  out.reference = UrdfReader::optional(node, "reference");
  out.xml = to_xml(node);
  out.node = std::make_shared<const XmlNode>(node);
  out.source = node.where;
  const std::pair<const char*, std::optional<double>*> numbers[] = {
      {"mu1", &out.surface.mu},
      {"mu2", &out.surface.mu2},
      {"slip1", &out.surface.slip1},
      {"slip2", &out.surface.slip2},
      {"kp", &out.surface.kp},
      {"kd", &out.surface.kd},
      {"maxVel", &out.surface.max_velocity},
      {"minDepth", &out.surface.min_depth},
      {"stopStiffness", &out.stop_stiffness},
      {"stopRestitution", &out.stop_restitution}};
  for (const XmlNode& child : node.children) {
    if (child.is("plugin")) out.plugins.push_back(read_plugin(child, base, resolver));
    for (const auto& [name, value] : numbers) {
      if (child.is(name)) *value = read.number_of(child, value_of(child));
    }
    if (child.is("selfCollide") || child.is("self_collide")) out.self_collide = read_bool(child, diagnostics);
    if (child.is("gravity")) out.gravity = read_bool(child, diagnostics);
    if (child.is("turnGravityOff")) out.gravity = !read_bool(child, diagnostics);
    if (child.is("material")) out.material = value_of(child);
    if (child.is("fdir1")) out.surface.fdir1 = read_direction(child, read);
    if (child.is("collision")) read_surface(child, read, out.surface);
    if (child.is("doppel:contact")) out.surface.shape = read_contact_shape(child, read);
  }
  return out;
}

Transmission read_transmission(const XmlNode& node, Diagnostics& diagnostics) {
  UrdfReader read(diagnostics, "urdf.optional_value", "it has no effect");
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
  // PR2's form: the reduction of its only joint is beside it.
  const XmlNode* const reduction = node.first("mechanicalReduction");
  if (reduction != nullptr && !out.joints.empty() && !out.joints.front().mechanical_reduction)
    out.joints.front().mechanical_reduction = read.number_inside(*reduction);
  return out;
}

}  // namespace doppel
