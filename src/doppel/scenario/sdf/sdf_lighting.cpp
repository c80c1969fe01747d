#include "doppel/scenario/sdf/detail/sdf_lighting.h"

#include <algorithm>
#include <iterator>

#include "doppel/base/core/names.h"

namespace doppel::sdf {
namespace {

LightKind kind_of_light(const XmlNode& node, Elements& elements) {
  const std::string type = Elements::attribute(node, "type");
  const auto* const found = std::ranges::find(kLightKindNames, type);
  if (found != std::end(kLightKindNames))
    return static_cast<LightKind>(std::distance(std::begin(kLightKindNames), found));
  const auto nearest =
      nearest_name(type, std::vector<std::string>(std::begin(kLightKindNames), std::end(kLightKindNames)));
  elements.diagnostics.note("sdf.light_type", node.where,
                            "there is no light of the type '" + type + "'; a point light is read" +
                                (nearest ? "; did you mean '" + *nearest + "'?" : ""),
                            "write point, directional or spot");
  return LightKind::point;
}

}  // namespace

Light read_light(const XmlNode& node, const Pose& X, bool posed, Elements& elements) {
  elements.check(node, "light");
  Light light;
  light.name = Elements::attribute(node, "name");
  light.source = node.where;
  light.kind = kind_of_light(node, elements);
  if (posed) light.X_WL = X;
  const Eigen::Vector3d direction = elements.vector<3>(node, "direction").value_or(light.direction_W);
  if (direction.norm() > 1e-9) light.direction_W = light.X_WL.linear() * direction.normalized();
  light.diffuse = elements.colour(node, "diffuse").value_or(light.diffuse);
  light.specular = elements.colour(node, "specular").value_or(light.specular);
  light.cast_shadows = elements.truth(node, "cast_shadows", false);
  light.on = elements.truth(node, "light_on", true);
  light.intensity = elements.number_or(node, "intensity", light.intensity);
  light.range = elements.number_or(node, "range", light.range);
  if (const XmlNode* const attenuation = node.first("attenuation")) {
    light.range = elements.number_or(*attenuation, "range", light.range);
    light.attenuation_constant = elements.number_or(*attenuation, "constant", light.attenuation_constant);
    light.attenuation_linear = elements.number_or(*attenuation, "linear", light.attenuation_linear);
    light.attenuation_quadratic = elements.number_or(*attenuation, "quadratic", light.attenuation_quadratic);
  }
  if (const XmlNode* const spot = node.first("spot")) {
    light.inner_angle = elements.number_or(*spot, "inner_angle", 0);
    light.outer_angle = elements.number_or(*spot, "outer_angle", 0);
    light.falloff = elements.number_or(*spot, "falloff", 0);
  }
  return light;
}

Environment read_environment(const XmlNode& scene, Elements& elements) {
  elements.check(scene, "scene");
  Environment out;
  out.source = scene.where;
  out.ambient = elements.colour(scene, "ambient").value_or(out.ambient);
  out.background = elements.colour(scene, "background").value_or(out.background);
  out.shadows = elements.truth(scene, "shadows", true);
  if (const XmlNode* const sky = scene.first("sky")) {
    elements.check(*sky, "sky");
    out.sky = Sky{};
    out.sky->time = elements.number_or(*sky, "time", out.sky->time);
    out.sky->sunrise = elements.number_or(*sky, "sunrise", out.sky->sunrise);
    out.sky->sunset = elements.number_or(*sky, "sunset", out.sky->sunset);
  }
  return out;
}

}  // namespace doppel::sdf
