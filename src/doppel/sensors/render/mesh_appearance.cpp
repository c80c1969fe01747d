#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "doppel/description/meshes/mesh.h"
#include "doppel/sensors/render/detail/appearance.h"
#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr double kCrease = 0.7;  // rad: edges of CAD parts that are meant are sharper

// Exporters write where a texture was on their machine: it is also searched beside the mesh, and where models of
// Gazebo have it.
std::string find_texture(const std::string& written, const fs::path& mesh) {
  std::string name = written;
  std::replace(name.begin(), name.end(), '\\', '/');
  if (name.starts_with("file://")) name.erase(0, 7);
  const fs::path folder = mesh.parent_path(), file = fs::path(name).filename();
  std::error_code failed;
  for (const fs::path& candidate : {folder / name, folder / file, folder / "textures" / file,
                                    folder / "../textures" / file, folder / "../materials/textures" / file})
    if (fs::is_regular_file(candidate, failed)) return candidate.lexically_normal().string();
  return {};
}

MeshTexture texture_in(const ImportedMesh::Texture& from, const MeshGeometry& mesh,
                       std::vector<std::string>& remarks) {
  if (!from.bytes.empty()) return {"", from.bytes};
  std::string file = find_texture(from.path, mesh.path);
  if (file.empty()) remarks.push_back(fmt::format("its texture '{}' is not found", from.path));
  return {std::move(file), ""};
}

// The part of the file that is named; all of it without a name.
bool is_wanted(const ImportedMesh::Part& part, const std::string& submesh) {
  return submesh.empty() || std::find(part.names.begin(), part.names.end(), submesh) != part.names.end();
}

void add_file_part(const ImportedMesh::Part& part, int material, const Eigen::Vector3d& scale,
                   SurfaceMesh& out) {
  const Eigen::Vector3f factor = scale.cast<float>();
  const bool flipped = scale.prod() < 0;
  SurfaceMesh own;
  std::vector<Eigen::Vector3f> points;
  for (const Eigen::Vector3f& p : part.positions) points.emplace_back(p.cwiseProduct(factor));
  auto triangles = part.triangles;
  if (flipped)
    for (auto& t : triangles) std::swap(t[1], t[2]);
  if (part.normals_written) {
    own.positions = std::move(points);
    own.triangles = std::move(triangles);
    for (const Eigen::Vector3f& n : part.normals) own.normals.emplace_back(n.cwiseQuotient(factor));
    own.uvs = part.uvs;
  } else {
    own = with_normals(points, triangles, kCrease);
    if (!part.uvs.empty())
      for (const auto& t : triangles)
        for (const std::uint32_t corner : t) own.uvs.push_back(part.uvs[corner]);
  }
  const auto base = static_cast<std::uint32_t>(out.positions.size());
  const auto first = static_cast<std::uint32_t>(out.triangles.size());
  for (std::size_t i = 0; i < own.positions.size(); ++i) {
    out.positions.push_back(own.positions[i]);
    out.normals.push_back(unit_or_up(own.normals[i]));
    const bool placed = !own.uvs.empty() && own.uvs[i].allFinite();
    out.uvs.emplace_back(placed ? Eigen::Vector2f(own.uvs[i].x(), 1 - own.uvs[i].y())
                                : Eigen::Vector2f(Eigen::Vector2f::Zero()));
  }
  for (const auto& t : own.triangles) out.triangles.push_back({base + t[0], base + t[1], base + t[2]});
  out.parts.push_back({first, static_cast<std::uint32_t>(out.triangles.size()), material});
}

void centre(SurfaceMesh& mesh) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : mesh.positions) box.extend(p);
  for (Eigen::Vector3f& p : mesh.positions) p -= box.center();
}

bool is_stl(const std::string& path) {
  std::string ending = fs::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return ending == ".stl";
}

// The least for what is not a number.
float within(float value, float least, float most) {
  return value > least ? std::min(value, most) : least;
}

SurfaceMaterial material_in(const ImportedMesh::Material& from) {
  const auto share = [](float value) { return within(value, 0, 1); };
  SurfaceMaterial out;
  out.rgba = from.rgba.unaryExpr(share);
  out.emissive = from.emissive.unaryExpr(share);
  out.specular = share(0.3F * from.specular);
  out.shininess = within(from.shininess, 4, 256);
  out.texture = from.texture;
  return out;
}

}  // namespace

MeshAppearance load_appearance(const MeshGeometry& mesh) {
  MeshAppearance out;
  if (is_stl(mesh.path)) {
    const TriangleMesh triangles = load_mesh(mesh);
    out.mesh = with_normals(triangles.vertices, triangles.triangles, kCrease);
    return out;
  }
  return appearance_of(import_mesh(mesh.path), mesh);
}

MeshAppearance appearance_of(const ImportedMesh& file, const MeshGeometry& mesh) {
  MeshAppearance out;
  for (const ImportedMesh::Part& part : file.parts) {
    if (!is_wanted(part, mesh.submesh)) continue;
    const auto index = static_cast<std::size_t>(part.material);
    const bool given = index < file.materials.size() && file.materials[index].given;
    add_file_part(part, given ? part.material : -1, mesh.scale, out.mesh);
  }
  if (out.mesh.triangles.empty())
    throw InputError("mesh.empty", make_location(mesh.path), "the mesh has no triangles");
  if (mesh.center_submesh) centre(out.mesh);
  if (!std::all_of(out.mesh.positions.begin(), out.mesh.positions.end(),
                   [](const Eigen::Vector3f& p) { return p.allFinite(); }))
    throw InputError("mesh.unreadable", make_location(mesh.path),
                     "the mesh cannot be read: a corner is not a finite number", "export it again");
  for (const ImportedMesh::Material& material : file.materials)
    out.materials.push_back(material_in(material));
  for (const ImportedMesh::Texture& texture : file.textures)
    out.textures.push_back(texture_in(texture, mesh, out.remarks));
  return out;
}

}  // namespace doppel
