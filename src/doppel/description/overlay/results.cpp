#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "doppel/description/overlay/detail/overlay.h"

namespace doppel::overlay_detail {
namespace {

Eigen::Vector3d vector_fact(const Operation& operation, const Facts& facts, std::string_view key) {
  const std::string* text = find_fact(facts, key);
  const auto value = text != nullptr ? vector_of(*text) : std::nullopt;
  if (!value) {
    impossible(operation.where,
               fmt::format("'{}' of {} is '{}', which is not three numbers", key,
                           operation_target(operation.action), text != nullptr ? *text : std::string(kNone)));
  }
  return *value;
}

// Rounding produces 1e-17 in place of zero.
Eigen::Vector3d cleaned(Eigen::Vector3d v) {
  for (double& x : v) {
    if (std::abs(x) < 1e-15) x = 0;
  }
  return v;
}

std::string rotated(const Operation& operation, const Facts& was, const Eigen::Matrix3d& by) {
  const Eigen::Matrix3d R = rotation_from_rpy(vector_fact(operation, was, "rpy")) * by;
  return vector_text(cleaned(rpy_from_rotation(R)));
}

Facts baked_zero(const Operation& operation, const BakeZero& action, const Facts& was) {
  Eigen::Vector3d axis = vector_fact(operation, was, "axis");
  if (axis.norm() < 1e-9) {
    impossible(operation.where,
               fmt::format("the axis of {} has length 0, so its zero cannot be moved",
                           operation_target(operation.action)),
               "set the axis first (set_axis)");
  }
  axis.normalize();
  const std::string* type = find_fact(was, "type");
  if (type != nullptr && *type == "prismatic") {
    const Eigen::Vector3d along = rotation_from_rpy(vector_fact(operation, was, "rpy")) * axis;
    const Eigen::Vector3d xyz = vector_fact(operation, was, "xyz") - along * action.offset;
    return {{"xyz", vector_text(cleaned(xyz))}};
  }
  const Eigen::Matrix3d back = Eigen::AngleAxisd(-action.offset, axis).toRotationMatrix();
  return {{"rpy", rotated(operation, was, back)}};
}

void put(Facts& facts, const char* key, const std::optional<double>& value) {
  if (value) facts.emplace_back(key, number_text(*value));
}

Facts dynamics_facts(const SetDynamics& action) {
  Facts out;
  put(out, "damping", action.damping);
  put(out, "friction", action.friction);
  return out;
}

Facts servo_facts(const SetServo& action) {
  Facts out;
  for (const ServoField& field : servo_fields()) put(out, field.fact, action.*field.value);
  return out;
}

Facts scaled_masses(const ScaleMasses& action, const Facts& was) {
  const double factor = mass_factor(action, was);
  Facts out;
  for (const auto& [link, mass] : was) {
    if (const auto value = number_of(mass)) out.emplace_back(link, number_text(*value * factor));
  }
  return out;
}

Facts scales(const SetMeshScale& action, const Facts& was) {
  const std::string* old = find_fact(was, "scale");
  const std::string one = vector_text(action.scale);
  std::string out = one;
  if (old != nullptr) {
    const auto count = std::count(old->begin(), old->end(), ' ');
    for (auto more = count / 3; more > 0; --more) out += ' ' + one;
  }
  return {{"scale", out}};
}

void scale_link(XmlNode& link, const std::string& mass, double factor, const SourceLocation& where) {
  write_facts(link, {{"mass", mass}}, where);
  XmlNode* inertial = child_of(link, "inertial");
  XmlNode* inertia = inertial != nullptr ? child_of(*inertial, "inertia") : nullptr;
  if (inertia == nullptr) return;
  for (XmlAttribute& component : inertia->attributes) {
    if (const auto value = number_of(component.value)) component.value = number_text(*value * factor);
  }
}

void scale_meshes(XmlNode& link, const Eigen::Vector3d& scale, const SourceLocation& where) {
  for (XmlNode& child : link.children) {
    if (!child.is("visual") && !child.is("collision")) continue;
    XmlNode* geometry = child_of(child, "geometry");
    XmlNode* mesh = geometry != nullptr ? child_of(*geometry, "mesh") : nullptr;
    if (mesh != nullptr) set_attribute(*mesh, "scale", vector_text(scale), where);
  }
}

}  // namespace

void impossible(const SourceLocation& where, const std::string& why, const std::string& fix) {
  throw InputError("overlay.impossible", where, why, fix);
}

double mass_factor(const ScaleMasses& action, const Facts& was) {
  double sum = 0;
  for (const auto& [link, mass] : was) sum += number_of(mass).value_or(0);
  return sum > 0 ? action.total / sum : 1;
}

Facts result_of(const Operation& operation, const Facts& was, const Surroundings& around) {
  return std::visit(Overloaded{
                        [&](const FlipAxis&) -> Facts {
                          return {{"axis", vector_text(-vector_fact(operation, was, "axis"))}};
                        },
                        [&](const SetAxis& a) -> Facts {
                          return {{"axis", vector_text(a.axis)}};
                        },
                        [&](const RotateFrame& a) -> Facts {
                          return {{"rpy", rotated(operation, was, rotation_from_rpy(a.rpy))}};
                        },
                        [&](const BakeZero& a) { return baked_zero(operation, a, was); },
                        [](const SetOrigin& a) {
                          Facts out;
                          if (a.xyz) out.emplace_back("xyz", vector_text(*a.xyz));
                          if (a.rpy) out.emplace_back("rpy", vector_text(*a.rpy));
                          return out;
                        },
                        [](const SetLimit& a) {
                          Facts out;
                          put(out, "lower", a.lower);
                          put(out, "upper", a.upper);
                          put(out, "effort", a.effort);
                          put(out, "velocity", a.velocity);
                          return out;
                        },
                        [](const SetDynamics& a) { return dynamics_facts(a); },
                        [](const SetServo& a) { return servo_facts(a); },
                        [](const SetJointType& a) -> Facts {
                          return {{"type", a.type}};
                        },
                        [](const SetInertia& a) {
                          Facts out;
                          put(out, "mass", a.mass);
                          if (a.com) out.emplace_back("com", vector_text(*a.com));
                          for (const auto& [name, value] : a.components)
                            out.emplace_back(name, number_text(value));
                          return out;
                        },
                        [&](const ComputeInertia&) { return computed_inertia(operation, was, around); },
                        [&](const ScaleMasses& a) { return scaled_masses(a, was); },
                        [](const AttachToWorld&) -> Facts {
                          return {{"parent", "world"}};
                        },
                        [](const AddMimic& a) -> Facts {
                          return {{"leader", a.leader},
                                  {"multiplier", number_text(a.multiplier)},
                                  {"offset", number_text(a.offset)}};
                        },
                        [&](const ReplaceCollision& a) -> Facts {
                          return {{"collision", replaced_collision(a, operation.where, around)}};
                        },
                        [&](const SetMeshScale& a) { return scales(a, was); },
                        [](const Rename& a) -> Facts {
                          return a.kind == "robot" ? Facts{{"name", a.to}} : Facts{};
                        },
                        [](const AddRos2Control& a) -> Facts {
                          return {{"plugin", a.plugin}};
                        },
                        [](const Remove&) -> Facts {
                          return {{"content", kNone}};
                        },
                    },
                    operation.action);
}

void carry_out(const Operation& operation, const Facts& was, const Facts& result,
               const Surroundings& around) {
  XmlNode& root = around.root;
  const SourceLocation& where = operation.where;
  std::visit(
      Overloaded{
          [&](const ScaleMasses& a) {
            for (const auto& [name, mass] : result) {
              if (XmlNode* link = find_named(root, "link", name))
                scale_link(*link, mass, mass_factor(a, was), where);
            }
          },
          [&](const AttachToWorld& a) { attach_to_world(root, a, where); },
          [&](const AddMimic& a) {
            if (find_named(root, "joint", a.leader) == nullptr)
              impossible(where, fmt::format("there is no joint '{}' to mimic", a.leader));
            // Complete, because not every reader of URDF has the defaults.
            write_facts(*find_named(root, "joint", a.joint), result_of(operation, was, around), where);
          },
          [&](const SetServo& a) {
            write_facts(*find_named(root, "joint", a.joint), result, where);
            write_servo(root, a.joint, result, where);
          },
          [&](const ReplaceCollision& a) { replace_collision(a, where, around); },
          [&](const SetMeshScale& a) { scale_meshes(*find_named(root, "link", a.link), a.scale, where); },
          [&](const Rename& a) { rename(root, a); },
          [&](const AddRos2Control& a) { add_ros2_control(root, a, where); },
          [&](const Remove& a) { remove(root, a, where); },
          [&](const auto&) {
            XmlNode* target = find_named(root, target_kind(operation.action), target_name(operation.action));
            write_facts(*target, result, where);
          },
      },
      operation.action);
}

}  // namespace doppel::overlay_detail
