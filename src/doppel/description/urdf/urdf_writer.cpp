#include "doppel/description/urdf/urdf_writer.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "doppel/base/math/decimals.h"
#include "doppel/base/xml/element.h"

namespace doppel {
namespace {

constexpr double kNoLimit = 1e16;

XmlNode origin_element(const Origin& origin) {
  return element("origin", {{"xyz", decimals(origin.xyz)}, {"rpy", decimals(origin.rpy)}});
}

std::optional<XmlNode> shape_element(const Geometry& geometry) {
  if (const auto* box = std::get_if<Box>(&geometry)) return element("box", {{"size", decimals(box->size)}});
  if (const auto* ball = std::get_if<Sphere>(&geometry))
    return element("sphere", {{"radius", decimal(ball->radius)}});
  if (const auto* cylinder = std::get_if<Cylinder>(&geometry)) {
    return element("cylinder",
                   {{"radius", decimal(cylinder->radius)}, {"length", decimal(cylinder->length)}});
  }
  if (const auto* capsule = std::get_if<Capsule>(&geometry))
    return element("capsule", {{"radius", decimal(capsule->radius)}, {"length", decimal(capsule->length)}});
  const auto* mesh = std::get_if<MeshGeometry>(&geometry);
  if (mesh == nullptr || mesh->path.empty()) return std::nullopt;
  return element("mesh", {{"filename", "file://" + mesh->path}, {"scale", decimals(mesh->scale)}});
}

template <class Part>
std::optional<XmlNode> part_element(const char* kind, const Part& part) {
  auto shape = shape_element(part.geometry);
  if (!shape) return std::nullopt;
  XmlNode out =
      element(kind, {}, {origin_element(part.origin), element("geometry", {}, {std::move(*shape)})});
  if (!part.name.empty()) out.attributes.push_back({"name", part.name, {}});
  return out;
}

XmlNode material_element(const Material& material, const std::string& name) {
  XmlNode out = element("material", {{"name", name}});
  if (material.rgba) {
    const Eigen::Vector4d& rgba = *material.rgba;
    out.children.push_back(element("color", {{"rgba", decimals(rgba.head<3>()) + " " + decimal(rgba.w())}}));
  }
  if (!material.texture_path.empty())
    out.children.push_back(element("texture", {{"filename", "file://" + material.texture_path}}));
  return out;
}

XmlNode link_element(const Link& link) {
  XmlNode out = element("link", {{"name", link.name}});
  if (link.inertial) {
    const Inertial& in = *link.inertial;
    out.children.push_back(element("inertial", {},
                                   {origin_element(in.origin), element("mass", {{"value", decimal(in.mass)}}),
                                    element("inertia", {{"ixx", decimal(in.ixx)},
                                                        {"ixy", decimal(in.ixy)},
                                                        {"ixz", decimal(in.ixz)},
                                                        {"iyy", decimal(in.iyy)},
                                                        {"iyz", decimal(in.iyz)},
                                                        {"izz", decimal(in.izz)}})}));
  }
  int count = 0;
  for (const Visual& visual : link.visuals) {
    auto part = part_element("visual", visual);
    if (!part) continue;
    // Materials of one name are one material in URDF, so that each gets a name of its own.
    if (visual.material)
      part->children.push_back(
          material_element(*visual.material, link.name + "_material_" + std::to_string(++count)));
    out.children.push_back(std::move(*part));
  }
  for (const Collision& collision : link.collisions) {
    if (auto part = part_element("collision", collision)) out.children.push_back(std::move(*part));
  }
  return out;
}

XmlNode joint_element(const Joint& joint) {
  XmlNode out = element("joint", {{"name", joint.name}, {"type", joint_type_name(joint.type)}},
                        {origin_element(joint.origin), element("parent", {{"link", joint.parent}}),
                         element("child", {{"link", joint.child}})});
  if (joint.type == JointType::fixed || joint.type == JointType::floating) return out;
  out.children.push_back(element("axis", {{"xyz", decimals(joint.axis)}}));
  if (joint.limits || joint.type != JointType::continuous) {
    const JointLimits limits = joint.limits.value_or(JointLimits{});
    XmlNode limit = element("limit", {{"effort", decimal(limits.effort.value_or(kNoLimit))},
                                      {"velocity", decimal(limits.velocity.value_or(kNoLimit))}});
    if (joint.type != JointType::continuous) {
      limit.attributes.push_back({"lower", decimal(limits.lower), {}});
      limit.attributes.push_back({"upper", decimal(limits.upper), {}});
    }
    for (const RateLimit& rate : kRateLimits) {
      if (limits.*rate.value) limit.attributes.push_back({rate.name, decimal(*(limits.*rate.value)), {}});
    }
    out.children.push_back(std::move(limit));
  }
  if (joint.dynamics) {
    out.children.push_back(element("dynamics", {{"damping", decimal(joint.dynamics->damping)},
                                                {"friction", decimal(joint.dynamics->friction)}}));
  }
  if (joint.mimic) {
    out.children.push_back(element("mimic", {{"joint", joint.mimic->joint},
                                             {"multiplier", decimal(joint.mimic->multiplier)},
                                             {"offset", decimal(joint.mimic->offset)}}));
  }
  return out;
}

// The version that a parser needs for what is written.
UrdfVersion least_version(const RobotDescription& robot) {
  const bool rates = std::ranges::any_of(robot.joints, [](const Joint& joint) {
    return joint.limits && std::ranges::any_of(kRateLimits, [&joint](const RateLimit& rate) {
             return ((*joint.limits).*rate.value).has_value();
           });
  });
  const bool capsules = std::ranges::any_of(robot.links, [](const Link& link) {
    const auto among = [](const auto& parts) {
      return std::ranges::any_of(
          parts, [](const auto& part) { return std::holds_alternative<Capsule>(part.geometry); });
    };
    return among(link.visuals) || among(link.collisions);
  });
  if (rates) return kUrdf12;
  return capsules ? kUrdf11 : UrdfVersion{};
}

}  // namespace

const char* joint_type_name(JointType type) {
  switch (type) {
    case JointType::revolute:
      return "revolute";
    case JointType::continuous:
      return "continuous";
    case JointType::prismatic:
      return "prismatic";
    case JointType::floating:
      return "floating";
    case JointType::planar:
      return "planar";
    case JointType::fixed:
      break;
  }
  return "fixed";
}

std::string write_urdf(const RobotDescription& robot, UrdfVersion newest) {
  XmlNode out = element("robot", {{"name", robot.name}});
  const UrdfVersion version = std::min(least_version(robot), newest);
  if (version > UrdfVersion{}) out.attributes.push_back({"version", to_string(version), {}});
  for (const Link& link : robot.links) out.children.push_back(link_element(link));
  for (const Joint& joint : robot.joints) out.children.push_back(joint_element(joint));
  return to_xml(out);
}

std::string write_urdf(const RobotDescription& robot) {
  return write_urdf(robot, UrdfVersion{});
}

}  // namespace doppel
