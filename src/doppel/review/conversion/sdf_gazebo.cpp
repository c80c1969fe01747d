#include "doppel/review/conversion/detail/sdf_gazebo.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "doppel/base/math/decimals.h"
#include "doppel/base/xml/element.h"

namespace doppel {
namespace {

// Elements that control Gazebo's conversion of URDF and have no counterpart in SDF.
constexpr const char* kSettled[] = {"disableFixedJointLumping", "preserveFixedJoint", "material", "static"};
constexpr const char* kLinkElements[] = {"sensor",  "light", "particle_emitter", "projector", "audio_source",
                                         "battery", "plugin"};

template <std::size_t count>
bool one_of(const std::string& name, const char* const (&names)[count]) {
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

XmlNode& child_of(XmlNode& node, const std::string& name) {
  const auto found = std::find_if(node.children.begin(), node.children.end(),
                                  [&name](const XmlNode& child) { return child.is(name); });
  if (found != node.children.end()) return *found;
  node.children.push_back(element(name));
  return node.children.back();
}

void set(XmlNode& node, std::initializer_list<const char*> path, const std::string& value) {
  XmlNode* at = &node;
  for (const char* step : path) at = &child_of(*at, step);
  at->children = text_element("", value).children;
}

// "1" and "0" are how URDF writes SDF's booleans.
std::string as_truth(const std::string& text) {
  return text == "1" ? "true" : text == "0" ? "false" : text;
}

// <surface> of one collision; false: the element does not belong there.
bool set_surface(XmlNode& collision, const std::string& name, const std::string& value) {
  if (name == "mu1" || name == "mu") {
    set(collision, {"surface", "friction", "ode", "mu"}, value);
  } else if (name == "mu2" || name == "fdir1") {
    set(collision, {"surface", "friction", "ode", name.c_str()}, value);
  } else if (name == "kp" || name == "kd") {
    set(collision, {"surface", "contact", "ode", name.c_str()}, value);
  } else if (name == "maxVel" || name == "max_vel") {
    set(collision, {"surface", "contact", "ode", "max_vel"}, value);
  } else if (name == "minDepth" || name == "min_depth") {
    set(collision, {"surface", "contact", "ode", "min_depth"}, value);
  } else if (name == "maxContacts" || name == "max_contacts") {
    set(collision, {"max_contacts"}, value);
  } else {
    return false;
  }
  return true;
}

void drop(const GazeboExtension& extension, const std::string& name, Diagnostics& diagnostics) {
  diagnostics.warning(
      "sdf.dropped", extension.source,
      fmt::format("<{}> of <gazebo reference=\"{}\"> has no counterpart in SDF and is omitted", name,
                  extension.reference));
}

void add_to_link(const GazeboExtension& extension, XmlNode&& what, XmlNode& link, Diagnostics& diagnostics) {
  const std::string name = what.name, value = what.content();
  if (name == "selfCollide" || name == "self_collide") {
    set(link, {"self_collide"}, as_truth(value));
  } else if (name == "gravity" || name == "turnGravityOff") {
    const bool off = name == "turnGravityOff";
    set(link, {"gravity"}, as_truth(off ? (value == "true" || value == "1" ? "0" : "1") : value));
  } else if (name == "dampingFactor") {
    set(link, {"velocity_decay", "linear"}, value);
    set(link, {"velocity_decay", "angular"}, value);
  } else if (one_of(name, kLinkElements)) {
    link.children.push_back(std::move(what));
  } else if (name == "visual" || name == "collision") {
    // Its children go into every visual or collision of the link, or into those of its name.
    const XmlAttribute* const one = what.find("name");
    for (XmlNode& shape : link.children) {
      const XmlAttribute* const own = shape.find("name");
      if (shape.is(name) && (one == nullptr || (own != nullptr && own->value == one->value)))
        shape.children.insert(shape.children.end(), what.children.begin(), what.children.end());
    }
  } else if (!one_of(name, kSettled)) {
    bool known = false;
    XmlNode scratch = element("collision");
    known = set_surface(scratch, name, value);
    for (XmlNode& shape : link.children) {
      if (shape.is("collision")) set_surface(shape, name, value);
    }
    if (!known) drop(extension, name, diagnostics);
  }
}

void add_to_joint(const GazeboExtension& extension, XmlNode&& what, XmlNode& joint,
                  Diagnostics& diagnostics) {
  const std::string name = what.name, value = what.content();
  const bool moves = joint.first("axis") != nullptr;
  if ((name == "springStiffness" || name == "spring_stiffness") && moves) {
    set(joint, {"axis", "dynamics", "spring_stiffness"}, value);
  } else if ((name == "springReference" || name == "spring_reference") && moves) {
    set(joint, {"axis", "dynamics", "spring_reference"}, value);
  } else if (name == "stopStiffness" && moves) {
    set(joint, {"axis", "limit", "stiffness"}, value);
  } else if (name == "stopRestitution" && moves) {
    set(joint, {"physics", "ode", "bounce"}, value);
  } else if (name == "provideFeedback" || name == "provide_feedback") {
    set(joint, {"physics", "ode", "provide_feedback"}, as_truth(value));
  } else if (name == "implicitSpringDamper" || name == "implicit_spring_damper") {
    set(joint, {"physics", "ode", "implicit_spring_damper"}, as_truth(value));
  } else if (name == "sensor") {
    joint.children.push_back(std::move(what));
  } else if (!one_of(name, kSettled)) {
    drop(extension, name, diagnostics);
  }
}

// The extension as XML; one of an SDF model has no text of its own.
XmlNode as_xml(const GazeboExtension& extension) {
  if (!extension.xml.empty()) return parse_xml(extension.xml, "<gazebo>");
  XmlNode out = element("gazebo");
  for (const GazeboPlugin& plugin : extension.plugins)
    out.children.push_back(parse_xml(plugin.xml, "<plugin>"));
  if (extension.gravity) out.children.push_back(text_element("gravity", truth(*extension.gravity)));
  if (extension.stop_stiffness)
    out.children.push_back(text_element("stopStiffness", decimal(*extension.stop_stiffness)));
  if (extension.stop_restitution)
    out.children.push_back(text_element("stopRestitution", decimal(*extension.stop_restitution)));
  return out;
}

template <class Add>
void for_each_element(const RobotDescription& robot, const std::string& reference, Add&& add) {
  for (const GazeboExtension& extension : robot.gazebo) {
    if (extension.reference != reference) continue;
    XmlNode root = as_xml(extension);
    for (XmlNode& child : root.children) {
      if (child.kind == XmlNode::Kind::element) add(extension, std::move(child));
    }
  }
}

}  // namespace

void write_gazebo_of_robot(const RobotDescription& robot, std::vector<XmlNode>& model) {
  for_each_element(robot, "", [&model](const GazeboExtension&, XmlNode&& child) {
    if (child.name == "static" || child.name == "self_collide" || !one_of(child.name, kSettled))
      model.push_back(std::move(child));
  });
}

bool carries_sensor(const RobotDescription& robot, const std::string& link) {
  return std::any_of(robot.gazebo.begin(), robot.gazebo.end(), [&link](const GazeboExtension& extension) {
    return extension.reference == link && extension.xml.find("<sensor") != std::string::npos;
  });
}

void write_gazebo_of_link(const RobotDescription& robot, const std::string& name, XmlNode& link,
                          Diagnostics& diagnostics) {
  for_each_element(robot, name, [&](const GazeboExtension& extension, XmlNode&& child) {
    add_to_link(extension, std::move(child), link, diagnostics);
  });
}

void write_gazebo_of_joint(const RobotDescription& robot, const std::string& name, XmlNode& joint,
                           Diagnostics& diagnostics) {
  for_each_element(robot, name, [&](const GazeboExtension& extension, XmlNode&& child) {
    add_to_joint(extension, std::move(child), joint, diagnostics);
  });
}

}  // namespace doppel
