// Fuzz target: what the module around assimp gives of a mesh file, or the picture of a texture and an STL file. Scenes have valid indices, finite corners, unit normals, and colours within 0..1.
#include <unistd.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "doppel/description/meshes/mesh.h"
#include "doppel/sensors/render/detail/appearance.h"
#include "doppel/sensors/render/scene_builder.h"

namespace {

using namespace doppel;
namespace fs = std::filesystem;

class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  std::uint8_t byte() { return at_ < size_ ? data_[at_++] : std::uint8_t{0}; }
  float number() {  // any bits: also what is not a number
    std::uint32_t bits = 0;
    for (int i = 0; i < 4; ++i) bits = bits << 8 | byte();
    return std::bit_cast<float>(bits);
  }
  template <class Vector>
  Vector vector() {
    Vector out;
    for (float& value : out.reshaped()) value = number();
    return out;
  }
  std::string bytes(std::size_t most) {
    const std::size_t count = std::min(most, size_ - at_);
    std::string out(reinterpret_cast<const char*>(data_ + at_), count);
    at_ += count;
    return out;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

ImportedMesh::Part part_in(Input& input) {
  ImportedMesh::Part part;
  const std::size_t corners = 3 + input.byte() % 30, triangles = input.byte() % 40;
  const std::uint8_t has = input.byte();
  part.material = static_cast<std::int8_t>(input.byte());
  part.normals_written = (has & 1) != 0;
  for (std::size_t i = 0; i < corners; ++i) {
    part.positions.push_back(input.vector<Eigen::Vector3f>());
    if (part.normals_written) part.normals.push_back(input.vector<Eigen::Vector3f>());
    if ((has & 2) != 0) part.uvs.push_back(input.vector<Eigen::Vector2f>());
  }
  const auto corner = [&] { return static_cast<std::uint32_t>(input.byte() % corners); };
  for (std::size_t i = 0; i < triangles; ++i) part.triangles.push_back({corner(), corner(), corner()});
  return part;
}

ImportedMesh file_in(Input& input) {
  ImportedMesh file;
  if ((input.byte() & 1) != 0) file.textures.push_back({"gone.png", ""});
  file.textures.push_back({"", input.bytes(input.byte())});
  const int materials = input.byte() % 3, parts = 1 + input.byte() % 3;
  for (int i = 0; i < materials; ++i) {
    ImportedMesh::Material material;
    material.given = (input.byte() & 1) != 0;
    material.texture = input.byte() % (static_cast<int>(file.textures.size()) + 1) - 1;
    material.rgba = input.vector<Eigen::Vector4f>();
    material.emissive = input.vector<Eigen::Vector3f>();
    material.specular = input.number();
    material.shininess = input.number();
    file.materials.push_back(material);
  }
  for (int i = 0; i < parts; ++i) file.parts.push_back(part_in(input));
  return file;
}

void demand(bool condition) {
  if (!condition) std::abort();
}

bool is_share(const auto& colour) {
  return (colour.array() >= 0).all() && (colour.array() <= 1).all();
}

void check_mesh(const SurfaceMesh& mesh, std::size_t materials) {
  demand(mesh.normals.size() == mesh.positions.size());
  demand(mesh.uvs.empty() || mesh.uvs.size() == mesh.positions.size());
  for (const auto& p : mesh.positions) demand(p.allFinite());
  for (const auto& n : mesh.normals) demand(std::abs(n.norm() - 1) < 1e-3F);
  for (const auto& uv : mesh.uvs) demand(uv.allFinite());
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) demand(corner < mesh.positions.size());
  std::uint32_t end = 0;
  for (const SurfaceMesh::Part& part : mesh.parts) {
    demand(part.begin == end && part.material < static_cast<int>(materials));
    end = part.end;
  }
  demand(end == mesh.triangles.size());
}

void check_material(const SurfaceMaterial& material, std::size_t textures) {
  demand(is_share(material.rgba) && is_share(material.emissive));
  demand(std::isfinite(material.specular) && std::isfinite(material.shininess));
  demand(material.texture < static_cast<int>(textures));
}

void check_scene(const RenderScene& scene) {
  for (const Bitmap& texture : scene.textures) demand(texture.empty() || texture.channels >= 3);
  for (const SurfaceMaterial& material : scene.materials) check_material(material, scene.textures.size());
  for (const auto& mesh : scene.meshes) check_mesh(*mesh, scene.materials.size());
  for (const SceneItem& item : scene.items) {
    demand(static_cast<std::size_t>(item.mesh) < scene.meshes.size());
    demand(static_cast<std::size_t>(item.material) < scene.materials.size());
  }
}

// In a folder of its own, of which there is one for each process.
std::string written(const std::string& name, const std::string& bytes) {
  static const fs::path folder = [] {
    fs::path made = fs::temp_directory_path() / ("doppel_scene_fuzz_" + std::to_string(getpid()));
    fs::create_directories(made);
    std::atexit([] {
      std::error_code none;
      fs::remove_all(fs::temp_directory_path() / ("doppel_scene_fuzz_" + std::to_string(getpid())), none);
    });
    return made;
  }();
  std::ofstream(folder / name, std::ios::binary) << bytes;
  return (folder / name).string();
}

// STL from memory: by its path, what the own reader rejects would go to assimp, which leaks.
void build_scene(Input& input) {
  Visual visual;
  visual.material.emplace();
  visual.material->texture_path = written("texture.png", input.bytes(4U * input.byte()));
  visual.geometry = Box{{1, 1, 1}};
  Link link;
  link.visuals = {visual, visual};
  SceneBuilder builder;
  Diagnostics diagnostics;
  builder.add(link, "fuzzed", diagnostics);
  check_scene(*builder.finish());
  const TriangleMesh read = parse_mesh(input.bytes(8192), "stl", "input.stl", Eigen::Vector3d(1, 1, -1));
  check_mesh(with_normals(read.vertices, read.triangles, 0.7), 0);
}

void convert_file(Input& input) {
  const MeshGeometry geometry{"a.dae", Eigen::Vector3d(1, 2, -1), "/nowhere/a.dae", "",
                              (input.byte() & 1) != 0};
  const MeshAppearance made = appearance_of(file_in(input), geometry);
  check_mesh(made.mesh, made.materials.size());
  for (const SurfaceMaterial& material : made.materials) check_material(material, made.textures.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  Input input(data + 1, size - 1);
  try {
    if (data[0] % 2 == 0)
      build_scene(input);
    else
      convert_file(input);
  } catch (const InputError&) {
    // Refused by its message.
  }
  return 0;
}
