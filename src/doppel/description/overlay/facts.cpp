#include <fmt/format.h>

#include <array>
#include <cstdint>

#include "doppel/base/core/fnv_hash.h"
#include "doppel/description/overlay/detail/overlay.h"
#include "doppel/description/urdf/urdf_version.h"

namespace doppel::overlay_detail {
namespace {

constexpr std::string_view kQuaternion = "quat_xyzw";  // of an <origin>, in the place of rpy

// The place of a plain fact in its joint or link: below `outer` (if any), in `element`.
struct Slot {
  std::string_view key, outer, element, attribute, absent;
};
constexpr std::array kSlots{
    Slot{"axis", "", "axis", "xyz", "1 0 0"},
    Slot{"xyz", "", "origin", "xyz", "0 0 0"},
    Slot{"rpy", "", "origin", "rpy", "0 0 0"},
    Slot{"lower", "", "limit", "lower", kNone},
    Slot{"upper", "", "limit", "upper", kNone},
    Slot{"effort", "", "limit", "effort", kNone},
    Slot{"velocity", "", "limit", "velocity", kNone},
    Slot{"damping", "", "dynamics", "damping", kNone},
    Slot{"friction", "", "dynamics", "friction", kNone},
    Slot{"leader", "", "mimic", "joint", kNone},
    Slot{"multiplier", "", "mimic", "multiplier", "1"},
    Slot{"offset", "", "mimic", "offset", "0"},
    Slot{"type", "", "", "type", kNone},
    Slot{"mass", "inertial", "mass", "value", kNone},
    Slot{"com", "inertial", "origin", "xyz", "0 0 0"},
    Slot{"inertial_rpy", "inertial", "origin", "rpy", "0 0 0"},
    Slot{"ixx", "inertial", "inertia", "ixx", kNone},
    Slot{"ixy", "inertial", "inertia", "ixy", kNone},
    Slot{"ixz", "inertial", "inertia", "ixz", kNone},
    Slot{"iyy", "inertial", "inertia", "iyy", kNone},
    Slot{"iyz", "inertial", "inertia", "iyz", kNone},
    Slot{"izz", "inertial", "inertia", "izz", kNone},
};

const Slot* slot_of(std::string_view key) {
  for (const Slot& slot : kSlots) {
    if (slot.key == key) return &slot;
  }
  return nullptr;
}

// The facts that are attributes of <doppel:servo> in the <gazebo> of a joint.
struct ServoSlot {
  std::string_view key, attribute;
};
constexpr std::array kServoSlots{ServoSlot{"stiffness", "stiffness"},
                                 ServoSlot{"servo_damping", "damping"},
                                 ServoSlot{"armature", "armature"},
                                 ServoSlot{"delay", "delay"},
                                 ServoSlot{"backlash", "backlash"},
                                 ServoSlot{"resolution", "resolution"},
                                 ServoSlot{"rms", "rms"}};
constexpr const char* kServoElement = "doppel:servo";
constexpr const char* kServoPrefix = "xmlns:doppel";

const ServoSlot* servo_slot_of(std::string_view key) {
  for (const ServoSlot& slot : kServoSlots) {
    if (slot.key == key) return &slot;
  }
  return nullptr;
}

// The last one has the word, as where a description is read.
std::string read_servo(const XmlNode& root, const std::string& joint, const ServoSlot& slot) {
  std::string out = kNone;
  for (const XmlNode& child : root.children) {
    if (!child.is("gazebo") || attribute_of(child, "reference") != joint) continue;
    for (const XmlNode& servo : child.children) {
      if (servo.is(kServoElement)) out = attribute_of(servo, slot.attribute, out);
    }
  }
  return out;
}

std::string read_slot(const XmlNode& target, const Slot& slot) {
  const XmlNode* node = &target;
  if (!slot.outer.empty()) node = node->first(slot.outer);
  if (node != nullptr && !slot.element.empty()) node = node->first(slot.element);
  // A rotation may be written as a quaternion.
  if (node != nullptr && slot.attribute == "rpy" && node->find("rpy") == nullptr) {
    const auto rpy = rpy_of_quaternion(attribute_of(*node, kQuaternion));
    if (rpy) return vector_text(*rpy);
  }
  return node != nullptr ? attribute_of(*node, slot.attribute, slot.absent) : std::string(slot.absent);
}

const XmlNode* target_of(const OperationAction& action, const XmlNode& root) {
  const std::string kind = target_kind(action);
  if (kind == "robot") return &root;
  if (kind == "gazebo") {
    for (const XmlNode& child : root.children) {
      if (child.is("gazebo") && attribute_of(child, "reference") == target_name(action)) return &child;
    }
    return nullptr;
  }
  return find_named(root, kind, target_name(action));
}

std::string shape_text(const XmlNode& shape) {
  if (shape.is("mesh")) {
    const std::string file = attribute_of(shape, "filename");
    return "mesh " + file.substr(file.find_last_of('/') + 1);
  }
  std::string out = shape.name;
  for (const XmlAttribute& attribute : shape.attributes) out += ' ' + attribute.value;
  return out;
}

std::string mesh_scales(const XmlNode& link) {
  std::string out;
  for (const XmlNode& child : link.children) {
    if (!child.is("visual") && !child.is("collision")) continue;
    const XmlNode* geometry = child.first("geometry");
    const XmlNode* mesh = geometry != nullptr ? geometry->first("mesh") : nullptr;
    if (mesh != nullptr) out += (out.empty() ? "" : " ") + attribute_of(*mesh, "scale", "1 1 1");
  }
  return out.empty() ? kNone : out;
}

void flatten(const XmlNode& node, std::string& out) {
  out += (out.empty() ? "" : " ") + node.name;
  for (const XmlAttribute& a : node.attributes) out += ' ' + a.name + '=' + a.value;
  if (const std::string text = node.content(); !text.empty()) out += ' ' + text;
  for (const XmlNode& child : node.children) {
    if (child.kind == XmlNode::Kind::element) flatten(child, out);
  }
}

// An element in one line; a long one by its checksum (FNV-1a), because it is only ever compared.
std::string content_of(const XmlNode& node) {
  std::string text;
  flatten(node, text);
  constexpr std::size_t kReadable = 100;
  if (text.size() <= kReadable) return text;
  return fmt::format("{} {:016x}", node.name, fnv_hash(text));
}

std::string removed_content(const Remove& action, const XmlNode& target) {
  if (action.kind == "collision" || action.kind == "visual") return shapes_text(target, action.kind);
  if (target_kind(action) == action.kind) return content_of(target);
  const XmlNode* child = target.first(action.kind);
  return child != nullptr ? content_of(*child) : kNone;
}

std::string plugin_of(const XmlNode& block) {
  const XmlNode* hardware = block.first("hardware");
  const XmlNode* plugin = hardware != nullptr ? hardware->first("plugin") : nullptr;
  return plugin != nullptr ? plugin->content() : kNone;
}

std::string above(const XmlNode& root, const std::string& link, bool name_of_joint) {
  const XmlNode* joint = joint_above(root, link);
  if (joint == nullptr) return kNone;
  return name_of_joint ? attribute_of(*joint, "name") : link_of(*joint, "parent");
}

// The facts that are no attribute of the target.
std::string read_special(const OperationAction& action, const XmlNode& root, const XmlNode& target,
                         const std::string& key) {
  const std::string name = target_name(action);
  if (const ServoSlot* slot = servo_slot_of(key)) return read_servo(root, name, *slot);
  if (key == "collision") return shapes_text(target, "collision");
  if (key == "scale") return mesh_scales(target);
  if (key == "plugin") return plugin_of(target);
  if (key == "joint") return above(root, name, true);
  if (key == "parent") return target.is("joint") ? link_of(target, "parent") : above(root, name, false);
  if (key == "child") return link_of(target, "child");
  if (key == "name") return attribute_of(target, "name");
  if (key == "content") return removed_content(std::get<Remove>(action), target);
  return kNone;
}

std::vector<std::string> keys_of_structure(const OperationAction& action) {
  const auto* gone = std::get_if<Remove>(&action);
  const std::string kind = gone != nullptr ? gone->kind : std::get<Rename>(action).kind;
  if (kind == "link") return {"joint", "parent"};
  if (kind == "joint") return {"parent", "child"};
  if (kind == "robot") return {"name"};
  if (kind == "ros2_control") return {"plugin"};
  return {"content"};
}

void add_if(std::vector<std::string>& keys, bool is_given, const char* key) {
  if (is_given) keys.emplace_back(key);
}

std::vector<std::string> given_keys(const SetOrigin& a) {
  std::vector<std::string> keys;
  add_if(keys, a.xyz.has_value(), "xyz");
  add_if(keys, a.rpy.has_value(), "rpy");
  return keys;
}

std::vector<std::string> given_keys(const SetLimit& a) {
  std::vector<std::string> keys;
  add_if(keys, a.lower.has_value(), "lower");
  add_if(keys, a.upper.has_value(), "upper");
  add_if(keys, a.effort.has_value(), "effort");
  add_if(keys, a.velocity.has_value(), "velocity");
  return keys;
}

std::vector<std::string> given_keys(const SetDynamics& a) {
  std::vector<std::string> keys;
  add_if(keys, a.damping.has_value(), "damping");
  add_if(keys, a.friction.has_value(), "friction");
  return keys;
}

std::vector<std::string> given_keys(const SetServo& a) {
  std::vector<std::string> keys;
  for (const ServoField& field : servo_fields()) add_if(keys, (a.*field.value).has_value(), field.fact);
  return keys;
}

std::vector<std::string> given_keys(const SetInertia& a) {
  std::vector<std::string> keys;
  add_if(keys, a.mass.has_value(), "mass");
  add_if(keys, a.com.has_value(), "com");
  for (const auto& [name, value] : a.components) keys.push_back(name);
  return keys;
}

std::vector<std::string> keys_of_zero(const BakeZero& a, const XmlNode& root) {
  const XmlNode* joint = find_named(root, "joint", a.joint);
  if (joint != nullptr && attribute_of(*joint, "type") == "prismatic") return {"type", "axis", "rpy", "xyz"};
  return {"type", "axis", "rpy"};
}

std::vector<std::string> links_with_mass(const XmlNode& root) {
  std::vector<std::string> out;
  for (const XmlNode& child : root.children)
    if (child.is("link") && read_slot(child, *slot_of("mass")) != kNone)
      out.push_back(attribute_of(child, "name"));
  return out;
}

}  // namespace

std::string shapes_text(const XmlNode& link, std::string_view element) {
  std::string out;
  for (const XmlNode& child : link.children) {
    const XmlNode* geometry = child.is(element) ? child.first("geometry") : nullptr;
    if (geometry == nullptr) continue;
    for (const XmlNode& shape : geometry->children) {
      if (shape.kind == XmlNode::Kind::element) out += (out.empty() ? "" : ", ") + shape_text(shape);
    }
  }
  return out.empty() ? kNone : out;
}

std::vector<std::string> fact_keys(const OperationAction& action, const XmlNode& root) {
  using Keys = std::vector<std::string>;
  return std::visit(Overloaded{
                        [](const FlipAxis&) { return Keys{"axis"}; },
                        [](const SetAxis&) { return Keys{"axis"}; },
                        [](const RotateFrame&) { return Keys{"rpy"}; },
                        [&](const BakeZero& a) { return keys_of_zero(a, root); },
                        [](const SetJointType&) { return Keys{"type"}; },
                        [](const ComputeInertia&) {
                          return Keys{"mass", "com", "inertial_rpy", "ixx", "ixy",
                                      "ixz",  "iyy", "iyz",          "izz"};
                        },
                        [&](const ScaleMasses&) { return links_with_mass(root); },
                        [](const AttachToWorld&) { return Keys{"parent"}; },
                        [](const AddMimic&) {
                          return Keys{"leader", "multiplier", "offset"};
                        },
                        [](const ReplaceCollision&) { return Keys{"collision"}; },
                        [](const SetMeshScale&) { return Keys{"scale"}; },
                        [](const AddRos2Control&) { return Keys{"plugin"}; },
                        [](const SetOrigin& a) { return given_keys(a); },
                        [](const SetLimit& a) { return given_keys(a); },
                        [](const SetDynamics& a) { return given_keys(a); },
                        [](const SetServo& a) { return given_keys(a); },
                        [](const SetInertia& a) { return given_keys(a); },
                        [](const auto& a) { return keys_of_structure(a); },
                    },
                    action);
}

std::optional<Facts> facts_of(const OperationAction& action, const XmlNode& root,
                              const std::vector<std::string>& keys) {
  Facts facts;
  const bool every_mass = std::holds_alternative<ScaleMasses>(action);
  const XmlNode* target = target_of(action, root);
  if (target == nullptr) {
    if (!std::holds_alternative<AddRos2Control>(action)) return std::nullopt;
    for (const std::string& key : keys) facts.emplace_back(key, kNone);
    return facts;
  }
  for (const std::string& key : keys) {
    if (every_mass) {
      const XmlNode* link = find_named(root, "link", key);
      facts.emplace_back(key, link != nullptr ? read_slot(*link, *slot_of("mass")) : kNone);
      continue;
    }
    const Slot* slot = slot_of(key);
    facts.emplace_back(
        key, slot != nullptr ? read_slot(*target, *slot) : read_special(action, root, *target, key));
  }
  return facts;
}

std::optional<std::string> value_without(std::string_view part, std::string_view key) {
  if (part == "collision" && key == "collision") return kNone;
  const Slot* slot = slot_of(key);
  if (slot == nullptr || (slot->outer != part && slot->element != part)) return {};
  return std::string(slot->absent);
}

void write_facts(XmlNode& target, const Facts& facts, const SourceLocation& where) {
  for (const auto& [key, value] : facts) {
    const Slot* slot = slot_of(key);
    if (slot == nullptr) continue;
    XmlNode* node = &target;
    if (!slot->outer.empty()) node = &child_or_new(*node, std::string(slot->outer), where);
    if (!slot->element.empty()) node = &child_or_new(*node, std::string(slot->element), where);
    // An origin has one of the two.
    if (slot->attribute == "rpy")
      std::erase_if(node->attributes, [](const XmlAttribute& a) { return a.name == kQuaternion; });
    set_attribute(*node, std::string(slot->attribute), value, where);
  }
}

void write_servo(XmlNode& root, const std::string& joint, const Facts& facts, const SourceLocation& where) {
  for (const auto& [key, value] : facts) {
    const ServoSlot* slot = servo_slot_of(key);
    if (slot == nullptr) continue;
    XmlNode* servo = nullptr;
    for (XmlNode& child : root.children) {
      if (!child.is("gazebo") || attribute_of(child, "reference") != joint) continue;
      for (XmlNode& one : child.children) {
        if (one.is(kServoElement)) servo = &one;
      }
    }
    if (servo == nullptr) {
      // xacro reads no prefix that is not declared.
      if (root.find(kServoPrefix) == nullptr) set_attribute(root, kServoPrefix, "urn:doppel", where);
      XmlNode gazebo = make_node("gazebo", where);
      set_attribute(gazebo, "reference", joint, where);
      gazebo.children.push_back(make_node(kServoElement, where));
      root.children.push_back(std::move(gazebo));
      servo = &root.children.back().children.back();
    }
    set_attribute(*servo, std::string(slot->attribute), value, where);
  }
}

}  // namespace doppel::overlay_detail
