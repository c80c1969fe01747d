#pragma once
// The scene that cameras, lidars and other sensors of light see: surfaces with materials, fixed to bodies, and
// lights. A scene is immutable and shared; from frame to frame only the poses of its bodies change. Colours are
// sRGB, 0..1.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/images/image.h"
#include "doppel/base/math/pose.h"
#include "doppel/description/meshes/lighting.h"
#include "doppel/export.h"

namespace doppel {

struct SurfaceMaterial {
  Eigen::Vector4f rgba{0.72F, 0.73F, 0.75F, 1.0F};  // multiplied by the texture; a: opacity
  Eigen::Vector3f emissive = Eigen::Vector3f::Zero();
  float specular = 0.08F;   // strength of the highlight, 0..1
  float shininess = 24.0F;  // exponent of Blinn and Phong
  int texture = -1;         // index into RenderScene::textures; -1: none
};

// Triangles of one surface, in the frame of their file or shape, m. Corners are not shared between triangles that
// meet at an edge: each has a normal of its own.
struct DOPPEL_API SurfaceMesh {
  std::vector<Eigen::Vector3f> positions, normals;  // [corners]; normals are unit and point outwards
  std::vector<Eigen::Vector2f> uvs;                 // [corners], v downwards from the picture's top; or empty
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise seen from outside
  struct Part {
    std::uint32_t begin = 0, end = 0;  // triangles
    int material = -1;                 // into RenderScene::materials; -1: that of the item
  };
  std::vector<Part> parts;  // in order, covering all triangles
};

// A surface on a body.
struct SceneItem {
  int mesh = 0, body = 0, material = 0;
  Pose X_BM = Pose::Identity();  // the mesh in its body
  std::uint32_t label = 0;  // in label images: its place among the items, from 1; 0 is where nothing is seen
  std::optional<std::uint16_t> class_label = {};  // of Gazebo's Label plugin: its class
};

struct SceneBody {
  std::string name;  // "kate::base_link", for messages
  int model = -1;    // of which it is a part
};

// A robot or an object as a whole.
struct SceneModel {
  std::string name;
};

struct RenderScene {
  std::vector<Bitmap> textures;  // of 3 or 4 channels
  std::vector<SurfaceMaterial> materials;
  std::vector<std::shared_ptr<const SurfaceMesh>> meshes;
  std::vector<SceneItem> items;
  std::vector<SceneBody> bodies;
  std::vector<SceneModel> models;
  std::vector<Light> lights;
  Environment environment;
};

}  // namespace doppel
