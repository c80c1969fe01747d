#include "doppel/rays/embree/embree_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace doppel::embree {
namespace {

void fill_triangles(RTCDevice device, RTCScene into, unsigned id, const SurfaceMesh& mesh, const Pose& X) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.positions.size()));
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Eigen::Vector3f p = (X * mesh.positions[i].cast<double>()).cast<float>();
    std::memcpy(positions + 3 * i, p.data(), 3 * sizeof(float));
  }
  void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), mesh.triangles.size());
  std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof mesh.triangles[0]);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(into, geometry, id);
  rtcReleaseGeometry(geometry);
}

ScenePtr new_scene(RTCDevice device, RTCBuildQuality quality) {
  ScenePtr scene(rtcNewScene(device));
  // Without gaps between neighbouring triangles, through which a lidar would see.
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene.get(), quality);
  return scene;
}

bool same(const Pose& a, const Pose& b) {
  return a.matrix() == b.matrix();
}

}  // namespace

EmbreeScene::EmbreeScene(std::shared_ptr<const RenderScene> scene)
    : scene_(std::move(scene)), device_(rtcNewDevice("threads=1")) {
  if (!device_) throw std::runtime_error("Embree cannot be started");
  meshes_.resize(scene_->meshes.size());
  poses_.assign(scene_->bodies.size(), Pose::Identity());
  body_moves_.assign(scene_->bodies.size(), false);
  instances_.assign(scene_->items.size(), nullptr);
  rotations_.assign(scene_->items.size(), Eigen::Matrix3f::Identity());
  bounds_.resize(scene_->items.size());
  moving_ = new_scene(device_.get(), RTC_BUILD_QUALITY_LOW);
  still_ = new_scene(device_.get(), RTC_BUILD_QUALITY_MEDIUM);
  rtcCommitScene(still_.get());
}

RTCScene EmbreeScene::mesh_scene(int mesh) {
  ScenePtr& scene = meshes_[static_cast<std::size_t>(mesh)];
  if (!scene) {
    scene = new_scene(device_.get(), RTC_BUILD_QUALITY_MEDIUM);
    fill_triangles(device_.get(), scene.get(), 0, *scene_->meshes[static_cast<std::size_t>(mesh)],
                   Pose::Identity());
    rtcCommitScene(scene.get());
  }
  return scene.get();
}

void EmbreeScene::add_still(std::size_t item) {
  const SceneItem& it = scene_->items[item];
  const Pose X_WM = poses_[static_cast<std::size_t>(it.body)] * it.X_BM;
  fill_triangles(device_.get(), still_.get(), static_cast<unsigned>(item),
                 *scene_->meshes[static_cast<std::size_t>(it.mesh)], X_WM);
}

void EmbreeScene::add_moving(std::size_t item) {
  RTCGeometry instance = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(instance, mesh_scene(scene_->items[item].mesh));
  rtcAttachGeometryByID(moving_.get(), instance, static_cast<unsigned>(item));
  rtcReleaseGeometry(instance);
  instances_[item] = instance;
  Sphere& sphere = bounds_[item];
  Eigen::AlignedBox3f box;
  const SurfaceMesh& mesh = *scene_->meshes[static_cast<std::size_t>(scene_->items[item].mesh)];
  for (const Eigen::Vector3f& p : mesh.positions) box.extend(p);
  if (!box.isEmpty()) sphere.centre_M = box.center().cast<double>();
  double squared = 0;
  for (const Eigen::Vector3f& p : mesh.positions)
    squared = std::max(squared, (p.cast<double>() - sphere.centre_M).squaredNorm());
  sphere.radius = std::sqrt(squared);
  sphere.place = moving_items_++;
  if (sphere.place % kLanes == 0)
    spheres_.push_back(Spheres{Floats3{}, broadcast(-std::numeric_limits<float>::infinity())});
}

void EmbreeScene::place_sphere(std::size_t item, const Pose& X_WM) {
  const Sphere& sphere = bounds_[item];
  const Eigen::Vector3f centre = (X_WM * sphere.centre_M).cast<float>();
  Spheres& into = spheres_[sphere.place / kLanes];
  const std::size_t lane = sphere.place % kLanes;
  into.centre.x[lane] = centre.x();
  into.centre.y[lane] = centre.y();
  into.centre.z[lane] = centre.z();
  // The margin is for rounding in single precision.
  into.radius[lane] = static_cast<float>(1.001 * sphere.radius + 1e-4 + 1e-5 * X_WM.translation().norm());
}

void EmbreeScene::place(std::size_t item, const Pose& X_WB) {
  const Pose X_WM = X_WB * scene_->items[item].X_BM;
  rotations_[item] = X_WM.linear().cast<float>();
  if (instances_[item] == nullptr) return;
  place_sphere(item, X_WM);
  const Eigen::Matrix<float, 3, 4> X = X_WM.matrix().topRows<3>().cast<float>();
  rtcSetGeometryTransform(instances_[item], 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, X.data());
  rtcCommitGeometry(instances_[item]);
}

void EmbreeScene::set_poses(std::span<const Pose> bodies) {
  bool any_moved = false, still_changed = !placed_;
  std::vector<bool> moved(bodies.size(), false);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    moved[b] = !placed_ || !same(poses_[b], bodies[b]);
    if (!moved[b]) continue;
    any_moved = true;
    poses_[b] = bodies[b];
    if (placed_ && !body_moves_[b]) still_changed = body_moves_[b] = true;
  }
  if (!any_moved) return;
  placed_ = true;
  for (std::size_t i = 0; i < scene_->items.size(); ++i) {
    const auto body = static_cast<std::size_t>(scene_->items[i].body);
    if (!moved[body]) continue;
    if (body_moves_[body] && instances_[i] == nullptr) add_moving(i);
    place(i, poses_[body]);
  }
  if (moving_items_ > 0) rtcCommitScene(moving_.get());
  if (!still_changed) return;
  still_ = new_scene(device_.get(), RTC_BUILD_QUALITY_MEDIUM);
  for (std::size_t i = 0; i < scene_->items.size(); ++i)
    if (!body_moves_[static_cast<std::size_t>(scene_->items[i].body)]) add_still(i);
  rtcCommitScene(still_.get());
}

namespace {

RTCIntersectContext coherent() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

#ifdef __AVX512F__
constexpr auto kIntersect = rtcIntersect16;
constexpr auto kOcclude = rtcOccluded16;
#else
constexpr auto kIntersect = rtcIntersect8;
constexpr auto kOcclude = rtcOccluded8;
#endif

// A search for triangles near a point.
struct NearSearch {
  const EmbreeScene& scene;
  int item;  // to whose mesh the tree belongs; -1: the tree is that of what stands still, its geometries are items
  int except_body;
  Eigen::Vector3d p_W;
  float radius;  // m
  bool found = false;
};

// By the bounds of the triangle and by its plane, so that few are counted that are further.
bool may_touch(const SurfaceMesh& mesh, unsigned triangle, const Eigen::Vector3f& p, float radius) {
  const auto& t = mesh.triangles[triangle];
  const Eigen::Vector3f &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
  const Eigen::Vector3f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  if ((p - p.cwiseMax(low).cwiseMin(high)).norm() > radius) return false;
  const Eigen::Vector3f normal = (b - a).cross(c - a);
  return std::abs(normal.dot(p - a)) <= radius * normal.norm();
}

bool look_at(RTCPointQueryFunctionArguments* at) {
  auto& search = *static_cast<NearSearch*>(at->userPtr);
  const std::size_t index = search.item >= 0 ? static_cast<std::size_t>(search.item) : at->geomID;
  const SceneItem& item = search.scene.scene().items[index];
  if (item.body == search.except_body) return false;
  const Eigen::Vector3f p_M = (search.scene.pose(index).inverse() * search.p_W).cast<float>();
  if (!may_touch(*search.scene.scene().meshes[static_cast<std::size_t>(item.mesh)], at->primID, p_M,
                 search.radius))
    return false;
  search.found = true;
  at->query->radius = 0;  // ends the search
  return true;
}

bool search_tree(RTCScene tree, const Eigen::Vector3d& p, NearSearch& search) {
  RTCPointQuery query{static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()), 0,
                      search.radius};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(tree, &query, &context, look_at, &search);
  return search.found;
}

}  // namespace

bool EmbreeScene::may_be_near(const Eigen::Vector3d& p_W, double radius, int except_body) const {
  // Rounding of single precision must not hide a surface that is exactly at the radius.
  NearSearch search{*this, -1, except_body, p_W, static_cast<float>(1.001 * radius + 1e-5), false};
  if (search_tree(still_.get(), p_W, search)) return true;
  for (std::size_t i = 0; i < instances_.size(); ++i) {
    const SceneItem& item = scene_->items[i];
    if (instances_[i] == nullptr || item.body == except_body) continue;
    search.item = static_cast<int>(i);
    if (search_tree(meshes_[static_cast<std::size_t>(item.mesh)].get(), pose(i).inverse() * p_W, search))
      return true;
  }
  return false;
}

bool EmbreeScene::may_meet_moving(Ints active, const RayPacket& rays) const {
  if (moving_items_ == 0 || !any(active)) return false;
  constexpr int kMiddle = kLanes / 2 + 1;
  const int lane = active[kMiddle] != 0 ? kMiddle : first_of(active);
  const Floats3 from{load(rays.org_x), load(rays.org_y), load(rays.org_z)},
      along{load(rays.dir_x), load(rays.dir_y), load(rays.dir_z)};
  const Floats3 d = along * (1.0F / norm(along));
  // The cone of one of the rays; the others begin within `spread` of its tip.
  const Floats3 tip{broadcast(from.x[lane]), broadcast(from.y[lane]), broadcast(from.z[lane])},
      axis{broadcast(d.x[lane]), broadcast(d.y[lane]), broadcast(d.z[lane])};
  const float cosine = smallest(active ? dot(d, axis) : broadcast(1.0F)) - 1e-6F;
  if (!(cosine > 0.0F)) return true;
  const float sine = std::sqrt(1.0F - cosine * cosine);
  const float spread = -smallest(active ? -norm(from - tip) : Floats{});
  for (const Spheres& spheres : spheres_) {
    const Floats3 to = spheres.centre - tip;
    const Floats ahead = dot(to, axis), beside = norm(to - axis * ahead), radius = spheres.radius + spread;
    if (any((beside * cosine - ahead * sine <= radius) & (ahead >= -radius))) return true;
  }
  return false;
}

void EmbreeScene::intersect(Ints active, RayHitPacket& rays) const {
  RTCIntersectContext context = coherent();
  const auto* valid = reinterpret_cast<const int*>(&active);
  kIntersect(valid, still_.get(), &context, &rays);
  if (!may_meet_moving(active, rays.ray)) return;
  kIntersect(valid, moving_.get(), &context, &rays);
  const Ints instance = load(rays.hit.instID[0]);
  store(instance != -1 ? instance : load(rays.hit.geomID), rays.hit.geomID);
}

void EmbreeScene::occlude(Ints active, RayPacket& rays) const {
  RTCIntersectContext context;  // Embree 3.13 does not return from some coherent packets of shadow rays
  rtcInitIntersectContext(&context);
  const auto* valid = reinterpret_cast<const int*>(&active);
  kOcclude(valid, still_.get(), &context, &rays);
  if (may_meet_moving(active & (load(rays.tfar) >= 0.0F), rays))
    kOcclude(valid, moving_.get(), &context, &rays);
}

bool EmbreeScene::occluded(RTCRay ray) const {
  for (const RTCScene tree : {still_.get(), moving_.get()}) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(tree, &context, &ray);
    if (ray.tfar < 0) return true;
  }
  return false;
}

}  // namespace doppel::embree
