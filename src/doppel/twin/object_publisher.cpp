#include "doppel/twin/object_publisher.h"

#include <algorithm>
#include <filesystem>
#include <span>
#include <utility>

#include "doppel/twin/pose_messages.h"
#include "doppel/twin/world_frame.h"

namespace doppel {
namespace {

using visualization_msgs::msg::Marker;

constexpr std::size_t kGoneToldAgain = 32;
constexpr double kMoved = 1e-5;  // m, and of a rotation matrix's entries

// Shape, size and colour.
Marker look_of(const WorldObject& object) {
  Marker marker;
  marker.ns = "objects";
  marker.text = object.name;
  marker.header.frame_id = "world";
  marker.color = {static_cast<float>(object.rgba[0]), static_cast<float>(object.rgba[1]),
                  static_cast<float>(object.rgba[2]), static_cast<float>(object.rgba[3])};
  if (const auto* box = std::get_if<Box>(&object.shape)) {
    marker.type = Marker::CUBE;
    marker.scale = to_vector_msg(box->size);
  } else if (const auto* sphere = std::get_if<Sphere>(&object.shape)) {
    marker.type = Marker::SPHERE;
    marker.scale = to_vector_msg(Eigen::Vector3d::Constant(2 * sphere->radius));
  } else if (const auto* cylinder = std::get_if<Cylinder>(&object.shape)) {
    marker.type = Marker::CYLINDER;
    marker.scale = {2 * cylinder->radius, 2 * cylinder->radius, cylinder->length};
  } else if (const auto* capsule = std::get_if<Capsule>(&object.shape)) {
    marker.type = Marker::CYLINDER;  // there is no marker for a capsule: the cylinder around it
    marker.scale = {2 * capsule->radius, 2 * capsule->radius, capsule->length + 2 * capsule->radius};
  } else if (const auto* mesh = std::get_if<MeshGeometry>(&object.shape)) {
    marker.type = Marker::MESH_RESOURCE;
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
  return in_a_package ? mesh.uri
                      : "file://" + std::filesystem::absolute(mesh.path).lexically_normal().string();
}

ObjectPublisher::ObjectPublisher(Bus& bus) : node_(bus, "/doppel") {
  topic_ = node_.advertise<visualization_msgs::msg::MarkerArray>("~/objects", {.depth = 1, .latched = true});
}

// Whoever has the engine may have put objects in or taken them out.
bool ObjectPublisher::names_are(const std::vector<WorldObject>& objects) const {
  const std::span told(message_.markers.data(), told_.size());
  return std::ranges::equal(told, objects, {}, &Marker::text, &WorldObject::name);
}

// An object keeps its id as long as it is there under its name.
void ObjectPublisher::list(const std::vector<WorldObject>& objects) {
  const auto before = static_cast<std::ptrdiff_t>(told_.size());
  std::vector<Marker> old(message_.markers.begin(), message_.markers.begin() + before);
  message_.markers.clear();
  for (const WorldObject& object : objects) {
    Marker marker = look_of(object);
    const auto known = std::ranges::find(old, object.name, &Marker::text);
    marker.id = known != old.end() ? known->id : next_id_++;
    if (known != old.end()) old.erase(known);
    message_.markers.push_back(std::move(marker));
  }
  for (const Marker& marker : old) gone_.push_back(marker.id);
  while (gone_.size() > kGoneToldAgain) gone_.pop_front();
  for (const std::int32_t id : gone_) message_.markers.push_back(deletion(id));
  told_.assign(objects.size(), std::nullopt);
}

bool ObjectPublisher::update_poses(const std::vector<WorldObject>& objects, const Engine& engine,
                                   const Pose& X_TW) {
  bool moved = false;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    Pose X_WO = Pose::Identity();
    engine.object_pose(objects[i].name, X_WO);
    const Pose X_TS = X_TW * X_WO * objects[i].X_OS;
    if (told_[i] && (X_TS.matrix() - told_[i]->matrix()).cwiseAbs().maxCoeff() <= kMoved) continue;
    told_[i] = X_TS;
    message_.markers[i].pose = to_pose_msg(X_TS);
    moved = true;
  }
  return moved;
}

void ObjectPublisher::publish_changes(const Model& model, const Engine& engine, Time now) {
  const std::vector<WorldObject>& objects = engine.objects();
  const bool was_listed = std::exchange(listed_, true) && names_are(objects);
  if (!was_listed) list(objects);
  const bool moved = update_poses(objects, engine, world_in_tf(model, engine));
  if (was_listed && !moved) return;
  const auto stamp = to_time_msg(node_.bus().stamp(now));
  for (Marker& marker : message_.markers) marker.header.stamp = stamp;
  topic_.publish(message_, now);
}

}  // namespace doppel
