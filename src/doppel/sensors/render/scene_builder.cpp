#include "doppel/sensors/render/scene_builder.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/read_file.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxTextureFile = std::size_t{256} << 20;  // bytes

// Cameras and their shading read RGB or RGBA.
Bitmap with_colour(Bitmap image) {
  if (image.channels >= 3 || image.empty()) return image;
  Bitmap out{image.width, image.height, image.channels + 2, {}};
  for (std::size_t i = 0; i < image.pixels.size(); i += static_cast<std::size_t>(image.channels)) {
    out.pixels.insert(out.pixels.end(), 3, image.pixels[i]);
    if (image.channels == 2) out.pixels.push_back(image.pixels[i + 1]);
  }
  return out;
}

Light default_sun() {
  Light sun;
  sun.kind = LightKind::directional;
  sun.direction_W = Eigen::Vector3d(-0.5, 0.3, -0.9).normalized();
  sun.diffuse = Eigen::Vector4d(0.9, 0.9, 0.88, 1);
  sun.cast_shadows = true;
  return sun;
}

}  // namespace

SceneBuilder::SceneBuilder() {
  scene_.materials.emplace_back();  // of a visual without a material
}

void SceneBuilder::begin_model(const std::string& name) {
  scene_.models.push_back({name});
}

int SceneBuilder::add_body(const std::string& name) {
  scene_.bodies.push_back({name, static_cast<int>(scene_.models.size()) - 1});
  return static_cast<int>(scene_.bodies.size()) - 1;
}

void SceneBuilder::add_item(int body, int mesh, const Pose& X_BM, int material,
                            std::optional<std::uint16_t> class_label) {
  const auto label = static_cast<std::uint32_t>(scene_.items.size()) + 1;
  scene_.items.push_back({mesh, body, material, X_BM, label, class_label});
}

void SceneBuilder::add_shape(int body, const Geometry& shape, const Pose& X_BS,
                             const SurfaceMaterial& material, std::optional<std::uint16_t> class_label) {
  scene_.meshes.push_back(std::make_shared<SurfaceMesh>(surface_of(shape)));
  scene_.materials.push_back(material);
  add_item(body, static_cast<int>(scene_.meshes.size()) - 1, X_BS,
           static_cast<int>(scene_.materials.size()) - 1, class_label);
}

int SceneBuilder::add(const Link& link, const std::string& name, Diagnostics& diagnostics,
                      std::span<const std::optional<std::uint16_t>> class_labels) {
  const int body = add_body(name);
  for (std::size_t i = 0; i < link.visuals.size(); ++i)
    add_visual(body, link.visuals[i], i < class_labels.size() ? class_labels[i] : std::nullopt, diagnostics);
  if (marks_missing_) add_missing(body, link, diagnostics);
  return body;
}

void SceneBuilder::add_visual(int body, const Visual& visual, std::optional<std::uint16_t> class_label,
                              Diagnostics& diagnostics) {
  const int material = material_of(visual, diagnostics);
  if (scene_.materials[static_cast<std::size_t>(material)].rgba[3] <= 0) return;
  std::optional<int> mesh;
  if (const auto* file = std::get_if<MeshGeometry>(&visual.geometry)) {
    mesh = load(*file, visual, diagnostics);
  } else {
    scene_.meshes.push_back(std::make_shared<SurfaceMesh>(surface_of(visual.geometry)));
    mesh = static_cast<int>(scene_.meshes.size()) - 1;
  }
  if (mesh) add_item(body, *mesh, visual.origin.pose(), material, class_label);
}

std::optional<int> SceneBuilder::load(const MeshGeometry& geometry, const Visual& visual,
                                      Diagnostics& diagnostics) {
  if (geometry.path.empty()) return std::nullopt;  // reported where the description is read
  const Eigen::Vector3d& s = geometry.scale;
  const std::string key = fmt::format("{}|{}|{}|{}|{}|{}", geometry.path, s.x(), s.y(), s.z(),
                                      geometry.submesh, geometry.center_submesh);
  const auto [found, fresh] = meshes_.try_emplace(key, std::nullopt);
  if (!fresh) return found->second;
  try {
    MeshAppearance loaded = load_appearance(geometry);
    const auto first_material = static_cast<int>(scene_.materials.size());
    const auto warn = [&](const std::string& remark) {
      diagnostics.warning("scene.texture", visual.source,
                          fmt::format("{}: {}; it is seen without it", geometry.uri, remark));
    };
    std::vector<int> textures;
    for (const MeshTexture& texture : loaded.textures)
      textures.push_back(texture_in(texture, geometry.path, warn));
    for (SurfaceMaterial& material : loaded.materials) {
      if (material.texture >= 0) material.texture = textures[static_cast<std::size_t>(material.texture)];
      scene_.materials.push_back(material);
    }
    for (SurfaceMesh::Part& part : loaded.mesh.parts)
      if (part.material >= 0) part.material += first_material;
    for (const std::string& remark : loaded.remarks) warn(remark);
    scene_.meshes.push_back(std::make_shared<SurfaceMesh>(std::move(loaded.mesh)));
    found->second = static_cast<int>(scene_.meshes.size()) - 1;
  } catch (const InputError& error) {
    diagnostics.warning(
        "scene.mesh", visual.source,
        fmt::format("{}: {}; sensors do not see it", geometry.uri, error.diagnostics().front().message));
  }
  return found->second;
}

int SceneBuilder::add_texture(std::string_view bytes, const std::string& name) {
  scene_.textures.push_back(with_colour(decode_image(bytes, name)));
  return static_cast<int>(scene_.textures.size()) - 1;
}

int SceneBuilder::texture_of(const std::string& path, const Warn& warn) {
  const auto [found, fresh] = textures_.try_emplace(path, -1);
  if (!fresh) return found->second;
  try {
    found->second = add_texture(read_file(path, kMaxTextureFile), path);
  } catch (const InputError& error) {
    warn(error.diagnostics().front().message);
  }
  return found->second;
}

int SceneBuilder::texture_in(const MeshTexture& texture, const std::string& mesh, const Warn& warn) {
  if (!texture.path.empty()) return texture_of(texture.path, warn);
  if (texture.bytes.empty()) return -1;
  try {
    return add_texture(texture.bytes, mesh);
  } catch (const InputError& error) {
    warn(error.diagnostics().front().message);
    return -1;
  }
}

int SceneBuilder::material_of(const Visual& visual, Diagnostics& diagnostics) {
  if (!visual.material) return 0;
  SurfaceMaterial material;
  const bool textured = !visual.material->texture_path.empty();
  if (visual.material->rgba) {
    material.rgba = visual.material->rgba->cast<float>().cwiseMax(0).cwiseMin(1);
  } else if (textured) {
    material.rgba = Eigen::Vector4f::Ones();
  }
  if (visual.material->emissive) material.emissive = visual.material->emissive->head<3>().cast<float>();
  if (visual.material->roughness) {
    // Blinn and Phong's exponent of a microfacet surface of this roughness.
    const auto r = static_cast<float>(std::clamp(*visual.material->roughness, 0.1, 1.0));
    material.shininess = 2 / (r * r * r * r) - 2 + 4;
    material.specular = 0.5F * (1 - r);
  }
  const auto warn = [&](const std::string& reason) {
    diagnostics.warning("scene.texture", visual.source, reason);
  };
  if (textured) material.texture = texture_of(visual.material->texture_path, warn);
  scene_.materials.push_back(material);
  return static_cast<int>(scene_.materials.size()) - 1;
}

std::shared_ptr<const RenderScene> SceneBuilder::finish() {
  if (scene_.lights.empty()) scene_.lights.push_back(default_sun());
  auto out = std::make_shared<RenderScene>(std::move(scene_));
  *this = SceneBuilder();
  return out;
}

}  // namespace doppel
