// Whatever assimp reads, as triangles.
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <Eigen/LU>
#include <algorithm>
#include <assimp/Importer.hpp>

#include "doppel/description/detail/mesh.h"
#include "doppel/export.h"

namespace doppel::mesh {
namespace {

void add_part(const aiScene& scene, const aiMesh& part, const Eigen::Matrix4d& X, TriangleSoup& soup) {
  const auto base = static_cast<std::uint32_t>(soup.points.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& p = part.mVertices[i];
    soup.points.push_back((X * Eigen::Vector4d(p.x, p.y, p.z, 1.0)).head<3>().cast<float>());
  }
  const bool inside_out = X.topLeftCorner<3, 3>().determinant() < 0;
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    const aiFace& face = part.mFaces[f];
    if (face.mNumIndices != 3) continue;  // points and lines
    const bool inside = std::all_of(face.mIndices, face.mIndices + 3,
                                    [&](unsigned corner) { return corner < part.mNumVertices; });
    if (!inside) continue;
    std::array<std::uint32_t, 3> t{base + face.mIndices[0], base + face.mIndices[1], base + face.mIndices[2]};
    if (inside_out) std::swap(t[1], t[2]);
    soup.triangles.push_back(t);
  }
  aiColor4D colour;
  const bool coloured =
      part.mMaterialIndex < scene.mNumMaterials && !soup.rgba &&
      scene.mMaterials[part.mMaterialIndex]->Get(AI_MATKEY_COLOR_DIFFUSE, colour) == AI_SUCCESS;
  if (coloured) soup.rgba = Eigen::Vector4f(colour.r, colour.g, colour.b, colour.a);
}

void add_node(const aiScene& scene, const aiNode& node, const Eigen::Matrix4d& X_parent, TriangleSoup& soup) {
  Eigen::Matrix4d local;
  const aiMatrix4x4& t = node.mTransformation;
  local << t.a1, t.a2, t.a3, t.a4, t.b1, t.b2, t.b3, t.b4, t.c1, t.c2, t.c3, t.c4, t.d1, t.d2, t.d3, t.d4;
  const Eigen::Matrix4d X = X_parent * local;
  for (unsigned i = 0; i < node.mNumMeshes; ++i) add_part(scene, *scene.mMeshes[node.mMeshes[i]], X, soup);
  for (unsigned i = 0; i < node.mNumChildren; ++i) add_node(scene, *node.mChildren[i], X, soup);
}

}  // namespace
}  // namespace doppel::mesh

// False: it cannot be read, for the reason in `problem`.
extern "C" DOPPEL_API bool doppel_import_mesh(const std::string& path, doppel::mesh::TriangleSoup& soup,
                                              std::string& problem) {
  try {
    Assimp::Importer importer;
    importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
    const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate);
    if (scene == nullptr || scene->mRootNode == nullptr) {
      problem = importer.GetErrorString();
      return false;
    }
    doppel::mesh::add_node(*scene, *scene->mRootNode, Eigen::Matrix4d::Identity(), soup);
    return true;
  } catch (const std::exception& error) {
    problem = error.what();
    return false;
  }
}
