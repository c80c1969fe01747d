// Whatever assimp reads, with its materials.
#include <assimp/GltfMaterial.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <assimp/Importer.hpp>
#include <map>

#include "doppel/description/meshes/imported_mesh.h"
#include "doppel/export.h"

namespace doppel {
namespace {

Eigen::Vector3f vector_of(const aiVector3D& v) {
  return {v.x, v.y, v.z};
}

class SceneReader {
 public:
  SceneReader(const aiScene& scene, ImportedMesh& out) : scene_(scene), out_(out) {}

  void read() {
    for (unsigned i = 0; i < scene_.mNumMaterials; ++i)
      out_.materials.push_back(material(*scene_.mMaterials[i]));
    add_node(*scene_.mRootNode, Eigen::Matrix4d::Identity(), {});
  }

 private:
  int texture(const aiString& path) {
    const auto [found, fresh] = textures_.try_emplace(path.C_Str(), static_cast<int>(out_.textures.size()));
    if (!fresh) return found->second;
    ImportedMesh::Texture texture;
    const aiTexture* embedded = scene_.GetEmbeddedTexture(path.C_Str());
    if (embedded != nullptr && embedded->mHeight == 0)
      texture.bytes.assign(reinterpret_cast<const char*>(embedded->pcData), embedded->mWidth);
    else
      texture.path = path.C_Str();
    out_.textures.push_back(std::move(texture));
    return found->second;
  }

  ImportedMesh::Material material(const aiMaterial& from) {
    ImportedMesh::Material out;
    aiString name, path;
    if (from.Get(AI_MATKEY_NAME, name) == AI_SUCCESS) out.name = name.C_Str();
    aiColor4D colour;
    if (from.Get(AI_MATKEY_COLOR_DIFFUSE, colour) == AI_SUCCESS)
      out.diffuse = Eigen::Vector4f(colour.r, colour.g, colour.b, colour.a);
    if (from.Get(AI_MATKEY_BASE_COLOR, colour) == AI_SUCCESS ||
        from.Get(AI_MATKEY_COLOR_DIFFUSE, colour) == AI_SUCCESS) {
      out.rgba = {colour.r, colour.g, colour.b, colour.a};
      out.given = out.name != AI_DEFAULT_MATERIAL_NAME;
    }
    float opacity = 1;
    // Many exporters write the opacity of a solid material as its complement; what cannot be seen at all is not meant.
    if (from.Get(AI_MATKEY_OPACITY, opacity) == AI_SUCCESS && opacity > 0) out.rgba[3] = opacity;
    if (from.Get(AI_MATKEY_COLOR_EMISSIVE, colour) == AI_SUCCESS)
      out.emissive = {colour.r, colour.g, colour.b};
    if (from.Get(AI_MATKEY_COLOR_SPECULAR, colour) == AI_SUCCESS)
      out.specular = (colour.r + colour.g + colour.b) / 3;
    from.Get(AI_MATKEY_SHININESS, out.shininess);
    if (from.GetTexture(aiTextureType_DIFFUSE, 0, &path) == AI_SUCCESS ||
        from.GetTexture(aiTextureType_BASE_COLOR, 0, &path) == AI_SUCCESS) {
      out.texture = texture(path);
      out.given = true;
    }
    return out;
  }

  void add_part(const aiMesh& from, const Eigen::Matrix4d& X, std::vector<std::string> names) {
    ImportedMesh::Part part;
    names.emplace_back(from.mName.C_Str());
    part.names = std::move(names);
    part.material = static_cast<int>(from.mMaterialIndex);
    part.normals_written = from.HasNormals();
    const Eigen::Matrix3d R = X.topLeftCorner<3, 3>(), for_normals = R.inverse().transpose();
    const bool inside_out = R.determinant() < 0;
    for (unsigned i = 0; i < from.mNumVertices; ++i) {
      part.positions.emplace_back(
          (X * vector_of(from.mVertices[i]).cast<double>().homogeneous()).head<3>().cast<float>());
      if (part.normals_written)
        part.normals.emplace_back(
            (for_normals * vector_of(from.mNormals[i]).cast<double>()).normalized().cast<float>());
      if (from.HasTextureCoords(0))
        part.uvs.emplace_back(from.mTextureCoords[0][i].x, from.mTextureCoords[0][i].y);
    }
    for (unsigned f = 0; f < from.mNumFaces; ++f) {
      const aiFace& face = from.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      std::array<std::uint32_t, 3> t{face.mIndices[0], face.mIndices[1], face.mIndices[2]};
      if (t[0] >= from.mNumVertices || t[1] >= from.mNumVertices || t[2] >= from.mNumVertices) continue;
      if (inside_out) std::swap(t[1], t[2]);
      part.triangles.push_back(t);
    }
    if (!part.triangles.empty()) out_.parts.push_back(std::move(part));
  }

  void add_node(const aiNode& node, const Eigen::Matrix4d& X_parent, std::vector<std::string> names) {
    Eigen::Matrix4d local;
    const aiMatrix4x4& t = node.mTransformation;
    local << t.a1, t.a2, t.a3, t.a4, t.b1, t.b2, t.b3, t.b4, t.c1, t.c2, t.c3, t.c4, t.d1, t.d2, t.d3, t.d4;
    const Eigen::Matrix4d X = X_parent * local;
    names.emplace_back(node.mName.C_Str());
    for (unsigned i = 0; i < node.mNumMeshes; ++i) add_part(*scene_.mMeshes[node.mMeshes[i]], X, names);
    for (unsigned i = 0; i < node.mNumChildren; ++i) add_node(*node.mChildren[i], X, names);
  }

  const aiScene& scene_;
  ImportedMesh& out_;
  std::map<std::string, int> textures_;
};

}  // namespace
}  // namespace doppel

// False: it cannot be read, for the reason in `problem`.
extern "C" DOPPEL_API bool doppel_import_mesh(const std::string& path, doppel::ImportedMesh& out,
                                              std::string& problem) {
  try {
    Assimp::Importer importer;
    importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
    const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate);
    if (scene == nullptr || scene->mRootNode == nullptr) {
      problem = importer.GetErrorString();
      return false;
    }
    doppel::SceneReader(*scene, out).read();
    return true;
  } catch (const std::exception& error) {
    problem = error.what();
    return false;
  }
}
