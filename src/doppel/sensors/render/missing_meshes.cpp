#include <array>
#include <cstdint>
#include <utility>

#include "doppel/sensors/render/scene_builder.h"

// The shapes that pictures show instead of meshes that were not found.

namespace doppel {
namespace {

constexpr double kBoxEdge = 0.1;                        // m, as in the page
constexpr int kStripe = 8, kTextureEdge = 4 * kStripe;  // pixels
constexpr std::array<std::uint8_t, 3> kRed{206, 44, 38}, kPale{250, 214, 210};

Bitmap diagonal_stripes() {
  Bitmap out{kTextureEdge, kTextureEdge, 3, {}};
  for (int y = 0; y < kTextureEdge; ++y) {
    for (int x = 0; x < kTextureEdge; ++x) {
      const auto& colour = (x + y) / kStripe % 2 == 0 ? kRed : kPale;
      out.pixels.insert(out.pixels.end(), colour.begin(), colour.end());
    }
  }
  return out;
}

// Each face has the whole texture once.
void lay_texture_on_faces(SurfaceMesh& box) {
  box.uvs.clear();
  for (std::size_t i = 0; i < box.positions.size(); ++i) {
    Eigen::Index normal = 0;
    box.normals[i].cwiseAbs().maxCoeff(&normal);
    const Eigen::Vector3f at =
        box.positions[i] / static_cast<float>(kBoxEdge) + Eigen::Vector3f::Constant(0.5F);
    box.uvs.emplace_back(at[(normal + 1) % 3], at[(normal + 2) % 3]);
  }
}

}  // namespace

// The index of the material of hatched boxes, which is made with the first one.
int SceneBuilder::hatched_material() {
  if (hatched_material_ >= 0) return hatched_material_;
  scene_.textures.push_back(diagonal_stripes());
  SurfaceMaterial material;
  material.rgba = Eigen::Vector4f::Ones();
  material.texture = static_cast<int>(scene_.textures.size()) - 1;
  scene_.materials.push_back(material);
  hatched_material_ = static_cast<int>(scene_.materials.size()) - 1;
  return hatched_material_;
}

void SceneBuilder::add_missing(int body, const Link& link, Diagnostics& diagnostics) {
  bool replaced = false;
  for (const Visual& visual : link.visuals) {
    const auto* file = std::get_if<MeshGeometry>(&visual.geometry);
    if (file == nullptr || load(*file, visual, diagnostics)) continue;
    if (std::exchange(replaced, true)) continue;  // the shapes are those of the whole link
    bool has_shape = false;
    for (const Collision& collision : link.collisions) {
      if (std::holds_alternative<MeshGeometry>(collision.geometry)) continue;
      add_shape(body, collision.geometry, collision.origin.pose(), SurfaceMaterial());
      has_shape = true;
    }
    if (has_shape) continue;
    SurfaceMesh box = surface_of(Box{Eigen::Vector3d::Constant(kBoxEdge)});
    lay_texture_on_faces(box);
    scene_.meshes.push_back(std::make_shared<SurfaceMesh>(std::move(box)));
    add_item(body, static_cast<int>(scene_.meshes.size()) - 1, visual.origin.pose(), hatched_material(), {});
  }
}

}  // namespace doppel
