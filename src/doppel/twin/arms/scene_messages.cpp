#include "doppel/twin/arms/detail/scene_messages.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/robot/scene_objects/octomap.h"
#include "doppel/sensors/rigs/pose_messages.h"

namespace doppel {
namespace {

using moveit_msgs::msg::CollisionObject;
using shape_msgs::msg::SolidPrimitive;

[[noreturn]] void refuse_shape(const std::string& id, const std::string& why, const std::string& fix = "") {
  throw InputError("scene.shape", {}, fmt::format("object '{}': {}", id, why), fix);
}

ObjectShape shape_of(const SolidPrimitive& primitive, const std::string& id) {
  const auto& d = primitive.dimensions;
  const auto require = [&](std::size_t count, const char* what) {
    if (d.size() != count)
      refuse_shape(id, fmt::format("{} has {} dimensions, not {}", what, d.size(), count));
  };
  switch (primitive.type) {
    case SolidPrimitive::BOX:
      require(3, "a box");
      return {Box{{d[SolidPrimitive::BOX_X], d[SolidPrimitive::BOX_Y], d[SolidPrimitive::BOX_Z]}}};
    case SolidPrimitive::SPHERE:
      require(1, "a sphere");
      return {Sphere{d[SolidPrimitive::SPHERE_RADIUS]}};
    case SolidPrimitive::CYLINDER:
      require(2, "a cylinder");
      return {Cylinder{d[SolidPrimitive::CYLINDER_RADIUS], d[SolidPrimitive::CYLINDER_HEIGHT]}};
    case SolidPrimitive::CONE:
      require(2, "a cone");
      return {Cone{d[SolidPrimitive::CONE_RADIUS], d[SolidPrimitive::CONE_HEIGHT]}};
    default:
      break;
  }
  refuse_shape(id, fmt::format("primitives of type {} are not known", primitive.type),
               "send a box, sphere, cylinder or cone, or a mesh");
}

ObjectShape shape_of(const shape_msgs::msg::Mesh& mesh, const std::string& /*id*/) {
  auto out = std::make_shared<TriangleMesh>();
  for (const geometry_msgs::msg::Point& p : mesh.vertices)
    out->vertices.push_back(Eigen::Vector3d(p.x, p.y, p.z).cast<float>());
  for (const shape_msgs::msg::MeshTriangle& triangle : mesh.triangles) {
    const auto& corners = triangle.vertex_indices;
    out->triangles.push_back({corners[0], corners[1], corners[2]});
  }
  return {SharedTriangles(out)};
}

ObjectShape shape_of(const shape_msgs::msg::Plane& plane, const std::string& /*id*/) {
  const auto& c = plane.coef;
  return {ScenePlane{{c[0], c[1], c[2]}, c[3]}};
}

template <class Shape>
void add_shapes(const std::vector<Shape>& shapes, const std::vector<geometry_msgs::msg::Pose>& poses,
                SceneObject& out) {
  if (poses.size() > shapes.size()) {
    throw InputError("scene.object", {},
                     fmt::format("object '{}' has {} shapes of a kind and {} poses for them", out.id,
                                 shapes.size(), poses.size()));
  }
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    ObjectShape shape = shape_of(shapes[i], out.id);
    if (i < poses.size()) shape.X_OS = object_pose(poses[i], out.id);
    out.shapes.push_back(std::move(shape));
  }
}

}  // namespace

Pose object_pose(const geometry_msgs::msg::Pose& pose, const std::string& id) {
  geometry_msgs::msg::Pose with_rotation = pose;
  const auto& q = pose.orientation;
  if (q.x == 0 && q.y == 0 && q.z == 0 && q.w == 0) with_rotation.orientation.w = 1;
  const std::optional<Pose> X = from_msg(with_rotation);
  if (X) return *X;
  throw InputError("scene.object", {},
                   fmt::format("a pose of object '{}' has a number that is not finite, or no rotation", id));
}

std::vector<Pose> shape_poses(const CollisionObject& message) {
  std::vector<Pose> out;
  for (const auto* poses : {&message.primitive_poses, &message.mesh_poses, &message.plane_poses}) {
    for (const geometry_msgs::msg::Pose& pose : *poses) out.push_back(object_pose(pose, message.id));
  }
  return out;
}

SceneObject object_from(const CollisionObject& message, const Pose& X_PH) {
  SceneObject out;
  out.id = message.id;
  add_shapes(message.primitives, message.primitive_poses, out);
  add_shapes(message.meshes, message.mesh_poses, out);
  add_shapes(message.planes, message.plane_poses, out);
  Pose X_HO = object_pose(message.pose, message.id);
  if (out.shapes.size() == 1 && X_HO.isApprox(Pose::Identity(), 0)) std::swap(X_HO, out.shapes.front().X_OS);
  out.X_PO = X_PH * X_HO;
  if (message.subframe_names.size() != message.subframe_poses.size()) {
    throw InputError("scene.object", {},
                     fmt::format("object '{}' has {} names of subframes and {} poses", message.id,
                                 message.subframe_names.size(), message.subframe_poses.size()));
  }
  for (std::size_t i = 0; i < message.subframe_names.size(); ++i)
    out.subframes.push_back({message.subframe_names[i], object_pose(message.subframe_poses[i], message.id)});
  return out;
}

SharedCells cells_from(const octomap_msgs::msg::Octomap& map) {
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(map.data.data());
  return occupied_cells({map.id, map.resolution, map.binary, {bytes, map.data.size()}});
}

}  // namespace doppel
