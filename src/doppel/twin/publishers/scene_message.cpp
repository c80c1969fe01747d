#include "doppel/twin/publishers/detail/scene_message.h"

#include <algorithm>

#include "doppel/description/meshes/heightmap.h"
#include "doppel/sensors/rigs/pose_messages.h"
#include "doppel/twin/publishers/object_publisher.h"

namespace doppel {
namespace {

constexpr int kMostDrawn =
    513;  // points of a terrain in a row or column; of larger ones every second, third ...

std_msgs::msg::ColorRGBA to_colour_msg(const Eigen::Vector4d& rgba) {
  const Eigen::Vector4f c = rgba.cast<float>();
  return {c[0], c[1], c[2], c[3]};
}

doppel_msgs::msg::Light to_light_msg(const Light& light, const Pose& X_TW) {
  doppel_msgs::msg::Light out;
  out.name = light.name;
  out.kind = static_cast<std::uint8_t>(light.kind);
  const Eigen::Vector3d at = X_TW * light.X_WL.translation();
  out.position = {at.x(), at.y(), at.z()};
  out.direction = to_vector_msg(X_TW.linear() * light.direction_W);
  out.diffuse = to_colour_msg(light.diffuse);
  out.specular = to_colour_msg(light.specular);
  out.intensity = light.intensity;
  out.range = light.range;
  out.attenuation_constant = light.attenuation_constant;
  out.attenuation_linear = light.attenuation_linear;
  out.attenuation_quadratic = light.attenuation_quadratic;
  out.inner_angle = light.inner_angle;
  out.outer_angle = light.outer_angle;
  out.falloff = light.falloff;
  out.cast_shadows = light.cast_shadows;
  return out;
}

std::string uri_of(const Image& image) {
  return image.path.empty() ? "" : file_uri(image.path);
}

}  // namespace

doppel_msgs::msg::Scene to_scene_msg(const WorldSettings& settings, const Pose& X_TW) {
  doppel_msgs::msg::Scene out;
  if (settings.environment) {
    out.has_environment = true;
    out.ambient = to_colour_msg(settings.environment->ambient);
    out.background = to_colour_msg(settings.environment->background);
    out.shadows = settings.environment->shadows;
    if (const auto& sky = settings.environment->sky) {
      out.sky = true;
      out.time = sky->time;
      out.sunrise = sky->sunrise;
      out.sunset = sky->sunset;
    }
  }
  for (const Light& light : settings.lights) {
    if (light.on) out.lights.push_back(to_light_msg(light, X_TW));
  }
  return out;
}

void add_material(const Material& material, std::int32_t marker, doppel_msgs::msg::Scene& out) {
  doppel_msgs::msg::PhysicalMaterial made;
  made.marker = marker;
  made.emissive = to_colour_msg(material.emissive.value_or(Eigen::Vector4d(0, 0, 0, 1)));
  made.roughness = material.roughness.value_or(made.roughness);
  made.metalness = material.metalness.value_or(made.metalness);
  made.normal_map = uri_of(material.normal_map);
  made.roughness_map = uri_of(material.roughness_map);
  made.metalness_map = uri_of(material.metalness_map);
  made.emissive_map = uri_of(material.emissive_map);
  const bool glows = material.emissive && material.emissive->head<3>().maxCoeff() > 0;
  if (glows || material.roughness || material.metalness || !made.normal_map.empty() ||
      !made.roughness_map.empty() || !made.metalness_map.empty() || !made.emissive_map.empty())
    out.materials.push_back(std::move(made));
}

void add_terrain(const Heightmap& map, std::int32_t marker, doppel_msgs::msg::Scene& out) {
  if (map.field == nullptr) return;
  const HeightField& field = *map.field;
  doppel_msgs::msg::Terrain made;
  made.marker = marker;
  made.size_x = field.size.x();
  made.size_y = field.size.y();
  const int step = (std::max(field.columns, field.rows) - 2) / (kMostDrawn - 1) + 1;
  // The last point of a row or column is always drawn, so that the terrain keeps its size.
  const int columns = (field.columns - 2) / step + 2, rows = (field.rows - 2) / step + 2;
  made.columns = static_cast<std::uint32_t>(columns);
  made.rows = static_cast<std::uint32_t>(rows);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const double x = (c / (columns - 1.0) - 0.5) * field.size.x(),
                   y = (r / (rows - 1.0) - 0.5) * field.size.y();
      made.heights.push_back(step == 1 ? field.at(c, r) : static_cast<float>(field.height(x, y)));
    }
  }
  for (const Heightmap::Texture& texture : map.textures) {
    made.textures.push_back(uri_of(texture.diffuse));
    made.normal_maps.push_back(uri_of(texture.normal));
    made.texture_sizes.push_back(texture.size);
  }
  for (const Heightmap::Blend& blend : map.blends) {
    made.blend_heights.push_back(blend.height);
    made.blend_distances.push_back(blend.distance);
  }
  out.terrains.push_back(std::move(made));
}

}  // namespace doppel
