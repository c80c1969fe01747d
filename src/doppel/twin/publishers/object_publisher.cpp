#include "doppel/twin/publishers/object_publisher.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "doppel/description/meshes/shape_mesh.h"
#include "doppel/description/meshes/texture_coordinates.h"
#include "doppel/sensors/rigs/pose_messages.h"
#include "doppel/twin/entities/entity.h"
#include "doppel/twin/publishers/detail/scene_message.h"

namespace doppel {
namespace {

using visualization_msgs::msg::Marker;

constexpr std::size_t kMaxDeletedRepeated = 32;
constexpr double kPlaneThickness = 1e-3;  // m
constexpr double kMoved = 1e-5;           // m, and of a rotation matrix's entries

void add_triangles(const TriangleMesh& mesh, Marker& marker) {
  marker.type = Marker::TRIANGLE_LIST;
  marker.scale = to_vector_msg(Eigen::Vector3d::Ones());
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      const Eigen::Vector3f& p = mesh.vertices[corner];
      marker.points.push_back({p.x(), p.y(), p.z()});
    }
  }
}

std::string part_resource(const MeshGeometry& mesh) {
  return mesh_resource(mesh) + "#" + mesh.submesh + (mesh.center_submesh ? "&center" : "");
}

// A file that cannot be read was reported when it was loaded for collisions.
void add_part(const MeshGeometry& mesh, bool embedded, Marker& marker) {
  try {
    add_triangles(load_mesh(mesh), marker);
    marker.mesh_resource = part_resource(mesh);
    marker.mesh_use_embedded_materials = embedded;
  } catch (const InputError&) {
    add_triangles({}, marker);
  }
}

// Shape, size and colour.
Marker marker_of(const std::string& object, const LinkVisual& visual) {
  const bool coloured = visual.material != nullptr && visual.material->rgba;
  const Eigen::Vector4d rgba = coloured ? *visual.material->rgba : Eigen::Vector4d(WorldObject{}.rgba);
  Marker marker;
  marker.ns = "objects";
  marker.text = object;
  marker.header.frame_id = "world";
  marker.color = {static_cast<float>(rgba[0]), static_cast<float>(rgba[1]), static_cast<float>(rgba[2]),
                  static_cast<float>(rgba[3])};
  if (visual.material != nullptr && !visual.material->texture_path.empty())
    marker.texture_resource = file_uri(visual.material->texture_path);
  if (const auto* box = std::get_if<Box>(visual.geometry)) {
    marker.type = Marker::CUBE;
    marker.scale = to_vector_msg(box->size);
  } else if (const auto* sphere = std::get_if<Sphere>(visual.geometry)) {
    marker.type = Marker::SPHERE;
    marker.scale = to_vector_msg(Eigen::Vector3d::Constant(2 * sphere->radius));
  } else if (const auto* cylinder = std::get_if<Cylinder>(visual.geometry)) {
    marker.type = Marker::CYLINDER;
    marker.scale = {2 * cylinder->radius, 2 * cylinder->radius, cylinder->length};
  } else if (const auto* capsule = std::get_if<Capsule>(visual.geometry)) {
    marker.type = Marker::CYLINDER;  // the bounding cylinder, because there is no marker for a capsule
    marker.scale = {2 * capsule->radius, 2 * capsule->radius, capsule->length + 2 * capsule->radius};
  } else if (const auto* ellipsoid = std::get_if<Ellipsoid>(visual.geometry)) {
    marker.type = Marker::SPHERE;
    marker.scale = to_vector_msg(2 * ellipsoid->radii);
  } else if (const auto* plane = std::get_if<Plane>(visual.geometry)) {
    marker.type = Marker::CUBE;
    marker.scale = {plane->size.x(), plane->size.y(), kPlaneThickness};
  } else if (const auto convex = convex_surface(*visual.geometry)) {
    add_triangles(*convex, marker);
    for (const Eigen::Vector2f& uv : texture_coordinates(*visual.geometry, *convex))
      marker.uv_coordinates.push_back({uv.x(), uv.y()});
  } else if (std::holds_alternative<Heightmap>(*visual.geometry)) {
    add_triangles({}, marker);  // its surface is in /doppel/scene
  } else if (const auto* mesh = std::get_if<MeshGeometry>(visual.geometry)) {
    if (mesh->path.empty()) {  // not found, which was reported when the world was read
      add_triangles({}, marker);
      return marker;
    }
    if (!mesh->submesh.empty()) {
      add_part(*mesh, !coloured, marker);
      return marker;
    }
    marker.type = Marker::MESH_RESOURCE;
    marker.mesh_use_embedded_materials = !coloured;
    marker.scale = to_vector_msg(mesh->scale);
    marker.mesh_resource = mesh_resource(*mesh);
  }
  return marker;
}

Marker deletion(std::int32_t id) {
  Marker marker;
  marker.header.frame_id = "world";
  marker.ns = "objects";
  marker.id = id;
  marker.action = Marker::DELETE;
  return marker;
}

}  // namespace

std::string mesh_resource(const MeshGeometry& mesh) {
  const bool in_a_package = mesh.uri.starts_with("package://") || mesh.uri.starts_with("model://");
  return in_a_package ? mesh.uri : file_uri(mesh.path);
}

std::string file_uri(const std::filesystem::path& file) {
  std::error_code none;
  return "file://" + std::filesystem::absolute(file, none).lexically_normal().string();
}

ObjectPublisher::ObjectPublisher(Bus& bus, const Scene& scene) : scene_(scene), node_(bus, "/doppel") {
  topic_ = node_.advertise<visualization_msgs::msg::MarkerArray>("~/objects", {.depth = 1, .latched = true});
  surroundings_ = node_.advertise<doppel_msgs::msg::Scene>("~/scene", {.depth = 1, .latched = true});
}

// An object keeps its id as long as it exists under its name.
void ObjectPublisher::list(Time now) {
  const auto before = static_cast<std::ptrdiff_t>(parts_.size());
  std::vector<Marker> old(message_.markers.begin(), message_.markers.begin() + before);
  message_.markers.clear();
  parts_.clear();
  doppel_msgs::msg::Scene surroundings =
      to_scene_msg(scene_.engine().world().settings(), scene_.world_in_tf());
  for (const int index : scene_.objects()) {
    const ModelInstance& object = scene_.instance(index).made_of();
    for (const LinkVisual& part : visuals_of(object)) {
      Marker marker = marker_of(object.name, part);
      const auto known = std::ranges::find(old, marker.text, &Marker::text);
      marker.id = known != old.end() ? known->id : next_id_++;
      if (known != old.end()) old.erase(known);
      if (part.material != nullptr) add_material(*part.material, marker.id, surroundings);
      if (const auto* map = std::get_if<Heightmap>(part.geometry)) add_terrain(*map, marker.id, surroundings);
      message_.markers.push_back(std::move(marker));
      Pose X_LS = part.origin->pose();
      if (const auto* plane = std::get_if<Plane>(part.geometry))
        X_LS = X_LS * Pose(rotation_from_z(plane->normal)) * Eigen::Translation3d(0, 0, -kPlaneThickness / 2);
      parts_.push_back({index, part.link, X_LS, std::nullopt});
    }
  }
  for (const Marker& marker : old) gone_.push_back(marker.id);
  while (gone_.size() > kMaxDeletedRepeated) gone_.pop_front();
  for (const std::int32_t id : gone_) message_.markers.push_back(deletion(id));
  surroundings_.publish(surroundings, now);
}

bool ObjectPublisher::update_poses() {
  const Pose X_TW = scene_.world_in_tf();
  bool moved = false;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    Part& part = parts_[i];
    const Pose X_TS = X_TW * scene_.instance(part.instance).link_pose(part.link) * part.X_LS;
    if (part.published && (X_TS.matrix() - part.published->matrix()).cwiseAbs().maxCoeff() <= kMoved)
      continue;
    part.published = X_TS;
    message_.markers[i].pose = to_pose_msg(X_TS);
    moved = true;
  }
  return moved;
}

void ObjectPublisher::publish_changes(Time now) {
  const bool was_listed = std::exchange(listed_, true);
  if (!was_listed) list(now);
  const bool moved = update_poses();
  if (was_listed && !moved) return;
  const auto stamp = to_time_msg(node_.bus().stamp(now));
  for (Marker& marker : message_.markers) marker.header.stamp = stamp;
  topic_.publish(message_, now);
}

}  // namespace doppel
