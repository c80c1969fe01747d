#include "doppel/description/mesh.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <assimp/Importer.hpp>
#include <cstring>
#include <unordered_map>

#include "doppel/core/diagnostic.h"

namespace doppel {
namespace {

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

class Collector {
 public:
  Collector(const Eigen::Vector3d& scale, TriangleMesh& mesh)
      : scale_(scale), flipped_(scale.prod() < 0), mesh_(mesh) {}

  void add(const aiScene& scene, const aiNode& node, const Eigen::Matrix4d& X_parent) {
    Eigen::Matrix4d local;
    const aiMatrix4x4& t = node.mTransformation;
    local << t.a1, t.a2, t.a3, t.a4, t.b1, t.b2, t.b3, t.b4, t.c1, t.c2, t.c3, t.c4, t.d1, t.d2, t.d3, t.d4;
    const Eigen::Matrix4d X = X_parent * local;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) add_part(scene, *scene.mMeshes[node.mMeshes[i]], X);
    for (unsigned i = 0; i < node.mNumChildren; ++i) add(scene, *node.mChildren[i], X);
  }

 private:
  void add_part(const aiScene& scene, const aiMesh& part, const Eigen::Matrix4d& X) {
    std::vector<std::uint32_t> index(part.mNumVertices);
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
      const aiVector3D& p = part.mVertices[i];
      const Eigen::Vector4d moved = X * Eigen::Vector4d(p.x, p.y, p.z, 1.0);
      index[i] = welded((moved.head<3>().array() * scale_.array()).matrix().cast<float>());
    }
    const bool inside_out = flipped_ != (X.topLeftCorner<3, 3>().determinant() < 0);
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      std::array<std::uint32_t, 3> t{index[face.mIndices[0]], index[face.mIndices[1]],
                                     index[face.mIndices[2]]};
      if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2]) continue;
      if (inside_out) std::swap(t[1], t[2]);
      mesh_.triangles.push_back(t);
    }
    aiColor4D colour;
    const bool coloured =
        part.mMaterialIndex < scene.mNumMaterials && !mesh_.rgba &&
        scene.mMaterials[part.mMaterialIndex]->Get(AI_MATKEY_COLOR_DIFFUSE, colour) == AI_SUCCESS;
    if (coloured) mesh_.rgba = Eigen::Vector4f(colour.r, colour.g, colour.b, colour.a);
  }

  std::uint32_t welded(Eigen::Vector3f p) {
    p += Eigen::Vector3f::Zero();  // -0 and 0 are one place
    Bits bits{};
    std::memcpy(bits.words.data(), p.data(), sizeof bits.words);
    const auto [found, fresh] = index_.try_emplace(bits, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (fresh) mesh_.vertices.push_back(p);
    return found->second;
  }

  Eigen::Vector3d scale_;
  bool flipped_;
  TriangleMesh& mesh_;
  std::unordered_map<Bits, std::uint32_t, BitsHash> index_;
};

}  // namespace

Eigen::AlignedBox3f TriangleMesh::bounds() const {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& v : vertices) box.extend(v);
  return box;
}

TriangleMesh load_mesh(const std::string& path, const Eigen::Vector3d& scale) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    throw InputError("mesh.unreadable", make_location(path),
                     fmt::format("the mesh cannot be read: {}", importer.GetErrorString()),
                     "STL, OBJ, COLLADA (.dae) and glTF are read; export it again as one of them");
  }
  TriangleMesh mesh;
  Collector(scale, mesh).add(*scene, *scene->mRootNode, Eigen::Matrix4d::Identity());
  if (mesh.triangles.empty()) {
    throw InputError("mesh.empty", make_location(path), "the mesh has no triangles",
                     "export it again with its faces");
  }
  return mesh;
}

}  // namespace doppel
