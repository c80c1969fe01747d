#pragma once
// A RenderScene from descriptions. Meshes and textures are read once for all that use them. One thread.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/sensors/render/render_scene.h"

namespace doppel {

// A picture that a mesh file names, or has in itself.
struct MeshTexture {
  std::string path;   // of the file that was found; empty: there is none
  std::string bytes;  // of an embedded one
};

// A mesh file as it looks: its surface, and its own materials, to which SurfaceMesh::Part refers.
struct MeshAppearance {
  SurfaceMesh mesh;
  std::vector<SurfaceMaterial> materials;
  std::vector<MeshTexture> textures;  // to which those materials refer
  std::vector<std::string> remarks;   // what of it cannot be shown, for a warning
};

// STL by the own reader, with normals smoothed below 40 degrees; all others by assimp, with their materials. Throws
// InputError as load_mesh().
DOPPEL_API MeshAppearance load_appearance(const MeshGeometry& mesh);

// The surface of a shape without a file. Chords of round shapes deviate by at most kChordError where 256 corners
// suffice for it, which is up to a radius of 0.66 m. A plane is a rectangle of its size.
inline constexpr double kChordError = 5e-5;  // m
DOPPEL_API SurfaceMesh surface_of(const Geometry& shape);

// Normals of each corner: the mean of the faces around its point whose normals are within `crease` rad of its own,
// by their angle there. The result has corners of its own for each triangle. Source: G. Thuermer and C. Wuethrich,
// "Computing vertex normals from polygonal facets", 1998.
DOPPEL_API SurfaceMesh with_normals(const std::vector<Eigen::Vector3f>& points,
                                    const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                    double crease);
// Its direction; z where it has none.
DOPPEL_API Eigen::Vector3f unit_or_up(const Eigen::Vector3f& normal);

class DOPPEL_API SceneBuilder {
 public:
  SceneBuilder();
  // For pictures, not for sensors: a visual whose mesh file was not found is drawn as its link's collision
  // shapes, or without any as a hatched red box.
  void mark_missing_meshes() { marks_missing_ = true; }
  // Bodies that follow are parts of this model.
  void begin_model(const std::string& name);
  // A body with the visuals of a link; returns its index. What cannot be read is left out with a warning at its place
  // ("scene.mesh", "scene.texture"). `class_labels`: of the visuals, or empty.
  int add(const Link& link, const std::string& name, Diagnostics& diagnostics,
          std::span<const std::optional<std::uint16_t>> class_labels = {});
  // A body without surfaces.
  int add_body(const std::string& name);
  void add_shape(int body, const Geometry& shape, const Pose& X_BS, const SurfaceMaterial& material,
                 std::optional<std::uint16_t> class_label = {});
  void add_light(const Light& light) { scene_.lights.push_back(light); }
  Environment& environment() { return scene_.environment; }
  // Without a light, the sun of a world without a file. The builder is empty afterwards.
  std::shared_ptr<const RenderScene> finish();

 private:
  void add_missing(int body, const Link& link, Diagnostics& diagnostics);
  int hatched_material();
  void add_visual(int body, const Visual& visual, std::optional<std::uint16_t> class_label,
                  Diagnostics& diagnostics);
  std::optional<int> load(const MeshGeometry& geometry, const Visual& visual, Diagnostics& diagnostics);
  int material_of(const Visual& visual, Diagnostics& diagnostics);
  // -1: it cannot be read; `warn` is called with the reason.
  using Warn = std::function<void(const std::string& reason)>;
  int add_texture(std::string_view bytes, const std::string& name);
  int texture_of(const std::string& path, const Warn& warn);
  int texture_in(const MeshTexture& texture, const std::string& mesh, const Warn& warn);
  void add_item(int body, int mesh, const Pose& X_BM, int material, std::optional<std::uint16_t> class_label);

  RenderScene scene_;
  std::map<std::string, std::optional<int>> meshes_;  // by file, scale and part; nullopt: it cannot be read
  std::map<std::string, int> textures_;
  bool marks_missing_ = false;
  int hatched_material_ = -1;  // -1: not made yet
};

}  // namespace doppel
