#include "doppel/description/meshes/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <unordered_map>

#include "doppel/base/core/names.h"
#include "doppel/base/core/plugin_module.h"
#include "doppel/base/core/read_file.h"
#include "doppel/description/meshes/detail/mesh.h"
#include "doppel/description/meshes/imported_mesh.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxMeshBytes = std::size_t{1} << 30;  // bytes

struct Bits {
  std::array<std::uint32_t, 3> words;
  bool operator==(const Bits&) const = default;
};
struct BitsHash {
  std::size_t operator()(const Bits& b) const {
    std::uint64_t h = b.words[0];
    h = (h * 0x9E3779B97F4A7C15ull) ^ b.words[1];
    h = (h * 0x9E3779B97F4A7C15ull) ^ b.words[2];
    return static_cast<std::size_t>(h * 0x9E3779B97F4A7C15ull >> 16);
  }
};

// Scales the triangles and merges equal corners to one vertex; unused points are left out.
class VertexWelder {
 public:
  VertexWelder(const mesh::TriangleSoup& soup, const Eigen::Vector3d& scale)
      : soup_(soup), scale_(scale), index_(soup.points.size(), kNone) {
    places_.reserve(soup.points.size());
  }

  TriangleMesh weld() {
    out_.rgba = soup_.rgba;
    out_.triangles.reserve(soup_.triangles.size());
    const bool flipped = scale_.prod() < 0;
    for (const auto& corners : soup_.triangles) {
      std::array<std::uint32_t, 3> t{vertex(corners[0]), vertex(corners[1]), vertex(corners[2])};
      if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2]) {
        ++out_.collapsed;
        continue;
      }
      if (flipped) std::swap(t[1], t[2]);
      out_.triangles.push_back(t);
    }
    return std::move(out_);
  }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  std::uint32_t vertex(std::uint32_t point) {
    if (index_[point] != kNone) return index_[point];
    Eigen::Vector3f p = (soup_.points[point].cast<double>().array() * scale_.array()).matrix().cast<float>();
    p += Eigen::Vector3f::Zero();  // makes -0 equal to 0
    Bits bits{};
    std::memcpy(bits.words.data(), p.data(), sizeof bits.words);
    const auto [found, fresh] = places_.try_emplace(bits, static_cast<std::uint32_t>(out_.vertices.size()));
    if (fresh) out_.vertices.push_back(p);
    return index_[point] = found->second;
  }

  const mesh::TriangleSoup& soup_;
  const Eigen::Vector3d scale_;
  std::vector<std::uint32_t> index_;  // by point: its vertex
  std::unordered_map<Bits, std::uint32_t, BitsHash> places_;
  TriangleMesh out_;
};

TriangleMesh finished(const mesh::TriangleSoup& soup, const std::string& name, const Eigen::Vector3d& scale) {
  TriangleMesh out = VertexWelder(soup, scale).weld();
  if (out.triangles.empty()) {
    throw InputError("mesh.empty", make_location(name), "the mesh has no triangles",
                     "export it again with faces");
  }
  return out;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return text;
}

// Files that the own reader rejects, but RViz and Gazebo show, because assimp reads them. If assimp fails,
// too, the own reader's message is more precise.
TriangleMesh read_leniently(const std::string& path, const Eigen::Vector3d& scale, const InputError& own) {
  try {
    TriangleMesh out = finished(mesh::read_by_assimp(path), path, scale);
    if (!std::all_of(out.vertices.begin(), out.vertices.end(), [](const auto& v) { return v.allFinite(); }))
      throw own;
    out.remark = own.diagnostics().front().message;
    return out;
  } catch (const MissingModule& missing) {
    mesh::refuse(path, 0,
                 own.diagnostics().front().message + ", and assimp was not asked: " + missing.what());
  } catch (const std::exception&) {
    throw own;
  }
}

}  // namespace

void mesh::refuse(const std::string& name, int line, std::string message) {
  throw InputError("mesh.unreadable", make_location(name, line), std::move(message),
                   "STL, OBJ, COLLADA (.dae) and glTF are read; export it again as one of them");
}

mesh::TriangleSoup mesh::read_by_assimp(const std::string& path) {
  const ImportedMesh file = import_mesh(path);
  TriangleSoup soup;
  for (const ImportedMesh::Part& part : file.parts) {
    const auto base = static_cast<std::uint32_t>(soup.points.size());
    soup.points.insert(soup.points.end(), part.positions.begin(), part.positions.end());
    for (const auto& t : part.triangles) soup.triangles.push_back({base + t[0], base + t[1], base + t[2]});
    const auto material = static_cast<std::size_t>(part.material);
    if (!soup.rgba && material < file.materials.size()) soup.rgba = file.materials[material].diffuse;
  }
  return soup;
}

Eigen::AlignedBox3f TriangleMesh::bounds() const {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& v : vertices) box.extend(v);
  return box;
}

TriangleMesh parse_mesh(std::string_view bytes, std::string_view format, const std::string& name,
                        const Eigen::Vector3d& scale) {
  if (format == "stl") return finished(mesh::read_stl(bytes, name), name, scale);
  if (format == "dae") return finished(mesh::read_collada(bytes, name), name, scale);
  if (format == "obj") {
    const fs::path folder = fs::path(name).parent_path();
    const mesh::Sidecar beside = [&folder](const std::string& file) {
      try {
        return read_file((folder / file).string(), std::size_t{1} << 20);
      } catch (const InputError&) {
        return std::string();
      }
    };
    return finished(mesh::read_obj(bytes, name, beside), name, scale);
  }
  mesh::refuse(name, 0, fmt::format("'{}' is not a format that can be read from memory", format));
}

namespace {

// Only the triangles of the part; throws "mesh.no_submesh".
mesh::TriangleSoup part_of(mesh::TriangleSoup soup, const MeshGeometry& mesh) {
  std::vector<std::array<std::uint32_t, 3>> kept;
  std::vector<std::string> names;
  for (const auto& part : soup.parts) {
    names.insert(names.end(), part.names.begin(), part.names.end());
    if (std::find(part.names.begin(), part.names.end(), mesh.submesh) == part.names.end()) continue;
    kept.insert(kept.end(), soup.triangles.begin() + static_cast<std::ptrdiff_t>(part.begin),
                soup.triangles.begin() + static_cast<std::ptrdiff_t>(part.end));
  }
  if (kept.empty()) {
    throw InputError(
        "mesh.no_submesh", make_location(mesh.path),
        fmt::format("the mesh has no part '{}'{}", mesh.submesh, did_you_mean(mesh.submesh, names)),
        "name a part of a COLLADA file, or leave out <submesh>");
  }
  soup.triangles = std::move(kept);
  return soup;
}

}  // namespace

TriangleMesh load_mesh(const MeshGeometry& mesh) {
  if (mesh.submesh.empty()) return load_mesh(mesh.path, mesh.scale);
  mesh::TriangleSoup soup;
  if (lower(fs::path(mesh.path).extension().string()) == ".dae")
    soup = mesh::read_collada(read_file(mesh.path, kMaxMeshBytes), mesh.path);
  TriangleMesh out = finished(part_of(std::move(soup), mesh), mesh.path, mesh.scale);
  if (mesh.center_submesh) {
    const Eigen::Vector3f centre = out.bounds().center();
    for (Eigen::Vector3f& p : out.vertices) p -= centre;
  }
  return out;
}

TriangleMesh load_mesh(const std::string& path, const Eigen::Vector3d& scale) {
  std::string format = lower(fs::path(path).extension().string());
  if (!format.empty()) format.erase(0, 1);
  if (format == "stl" || format == "obj" || format == "dae") {
    const std::string bytes = read_file(path, kMaxMeshBytes);
    mesh::refuse_pointer(bytes, path);
    try {
      return parse_mesh(bytes, format, path, scale);
    } catch (const InputError& own) {
      return read_leniently(path, scale, own);
    }
  }
  return finished(mesh::read_by_assimp(path), path, scale);
}

}  // namespace doppel
