#include "doppel/sensors/render/embree/embree_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
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

ScenePtr new_scene(RTCDevice device) {
  ScenePtr scene(rtcNewScene(device));
  // Without gaps between neighbouring triangles, through which a lidar would see.
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  return scene;
}

constexpr float kFurthest = 1e12F;  // m: Embree ends the process for rays that are not within about 1e18

// The lanes with rays that Embree takes.
Ints castable(const RayPacket& rays) {
  Ints out = ~Ints{};
  for (const float* values : {rays.org_x, rays.org_y, rays.org_z, rays.dir_x, rays.dir_y, rays.dir_z}) {
    const Floats value = load(values);
    out &= (value < kFurthest) & (value > -kFurthest);
  }
  return out;
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
  place_of_.assign(scene_->items.size(), -1);
  rotations_.assign(scene_->items.size(), Eigen::Matrix3f::Identity());
  still_ = new_scene(device_.get());
  rtcCommitScene(still_.get());
}

RTCScene EmbreeScene::mesh_scene(int mesh) {
  ScenePtr& scene = meshes_[static_cast<std::size_t>(mesh)];
  if (!scene) {
    scene = new_scene(device_.get());
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
  const SurfaceMesh& mesh = *scene_->meshes[static_cast<std::size_t>(scene_->items[item].mesh)];
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : mesh.positions) box.extend(p);
  const Eigen::Vector3d centre =
      box.isEmpty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(box.center().cast<double>());
  double squared = 0;
  for (const Eigen::Vector3f& p : mesh.positions)
    squared = std::max(squared, (p.cast<double>() - centre).squaredNorm());
  place_of_[item] = static_cast<int>(moving_.size());
  if (moving_.size() % kLanes == 0) spheres_.push_back(Spheres{Floats3{}, broadcast(-kInfinity)});
  moving_.push_back({item, mesh_scene(scene_->items[item].mesh), centre, std::sqrt(squared),
                     Eigen::Matrix3f::Identity(), Eigen::Vector3f::Zero()});
}

void EmbreeScene::place(std::size_t item, const Pose& X_WB) {
  const Pose X_WM = X_WB * scene_->items[item].X_BM;
  rotations_[item] = X_WM.linear().cast<float>();
  if (place_of_[item] < 0) return;
  const auto at = static_cast<std::size_t>(place_of_[item]);
  Moving& moving = moving_[at];
  moving.R_WM = rotations_[item];
  moving.p_WM = X_WM.translation().cast<float>();
  const Eigen::Vector3f centre = (X_WM * moving.centre_M).cast<float>();
  Spheres& into = spheres_[at / kLanes];
  const std::size_t lane = at % kLanes;
  into.centre.x[lane] = centre.x();
  into.centre.y[lane] = centre.y();
  into.centre.z[lane] = centre.z();
  // The margin is for rounding in single precision. Objects with a non-finite pose are skipped.
  const bool somewhere = X_WM.matrix().allFinite() && X_WM.translation().norm() < kFurthest;
  into.radius[lane] =
      !somewhere ? -kInfinity
                 : static_cast<float>(1.001 * moving.radius + 1e-4 + 1e-5 * X_WM.translation().norm());
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
    if (body_moves_[body] && place_of_[i] < 0) add_moving(i);
    place(i, poses_[body]);
  }
  if (!still_changed) return;
  still_ = new_scene(device_.get());
  for (std::size_t i = 0; i < scene_->items.size(); ++i)
    if (!body_moves_[static_cast<std::size_t>(scene_->items[i].body)]) add_still(i);
  rtcCommitScene(still_.get());
}

namespace {

// A search for triangles near a point.
struct NearSearch {
  const EmbreeScene& scene;
  int item;  // to whose mesh the tree belongs; -1: the tree is that of what stands still, its geometries are items
  int except_body;
  Eigen::Vector3d p_W;
  float radius;  // m
  bool found = false;
};

// Compares with the bounds of the triangle and with its plane, so that few are counted that are further.
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
  if (!p_W.allFinite()) return false;
  // Rounding of single precision must not hide a surface that is exactly at the radius.
  NearSearch search{*this, -1, except_body, p_W, static_cast<float>(1.001 * radius + 1e-5), false};
  if (search_tree(still_.get(), p_W, search)) return true;
  for (const Moving& moving : moving_) {
    if (scene_->items[moving.item].body == except_body) continue;
    search.item = static_cast<int>(moving.item);
    if (search_tree(moving.mesh, pose(moving.item).inverse() * p_W, search)) return true;
  }
  return false;
}

// About the direction of one of the rays; the others begin within `spread` of its tip.
struct EmbreeScene::Cone {
  Floats3 tip, axis;
  float cosine = 1, sine = 0, spread = 0, reach = 0;  // m: spread, and the end of the longest ray

  Cone(Ints active, const RayPacket& rays) {
    constexpr int kMiddle = kLanes / 2 + 1;
    const int lane = active[kMiddle] != 0 ? kMiddle : first_of(active);
    const Floats3 from{load(rays.org_x), load(rays.org_y), load(rays.org_z)},
        along{load(rays.dir_x), load(rays.dir_y), load(rays.dir_z)};
    const Floats length = norm(along);
    const Floats3 d = along * (1.0F / length);
    tip = {broadcast(from.x[lane]), broadcast(from.y[lane]), broadcast(from.z[lane])};
    axis = {broadcast(d.x[lane]), broadcast(d.y[lane]), broadcast(d.z[lane])};
    cosine = smallest(active ? dot(d, axis) : broadcast(1.0F)) - 1e-6F;
    sine = std::sqrt(std::max(0.0F, 1.0F - cosine * cosine));
    spread = -smallest(active ? -norm(from - tip) : Floats{});
    reach = -smallest(active ? load(rays.tfar) * -1.00001F * length : Floats{});
  }

  // The lanes of the spheres that the cone may meet.
  [[nodiscard]] Ints meets(const Spheres& spheres) const {
    const Floats3 to = spheres.centre - tip;
    const Floats squared = dot(to, to), ahead = dot(to, axis), radius = spheres.radius + spread,
                 furthest = reach + radius;
    const Ints within = (spheres.radius >= 0.0F) & (squared <= furthest * furthest);
    if (!(cosine > 0.0F)) return within;
    // Distance from the axis * cosine <= radius + ahead * sine; the margin is for rounding in the difference.
    const Floats beside = radius + ahead * sine;
    return within & (ahead >= -radius) &
           ((squared * 0.999999F - ahead * ahead) * (cosine * cosine) <= beside * beside);
  }
};

// The lanes whose rays meet a sphere before their ends.
Ints EmbreeScene::meeting(Ints active, const RayPacket& rays, const Spheres& spheres, std::size_t lane) {
  const Floats3 from{load(rays.org_x), load(rays.org_y), load(rays.org_z)},
      along{load(rays.dir_x), load(rays.dir_y), load(rays.dir_z)};
  const float radius = spheres.radius[lane];
  const Floats3 to = Floats3{broadcast(spheres.centre.x[lane]), broadcast(spheres.centre.y[lane]),
                             broadcast(spheres.centre.z[lane])} -
                     from;
  // The point of the ray that is nearest to the centre; the margins are for rounding in single precision.
  const Floats nearest = smaller(larger(dot(to, along) / dot(along, along), Floats{}), load(rays.tfar));
  const Floats3 past = to - along * nearest;
  return active & (dot(past, past) <= radius * radius + 1e-6F * dot(to, to));
}

template <class Cast>
void EmbreeScene::for_each_met(Ints active, const RayPacket& rays, Cast cast) const {
  if (moving_.empty() || !any(active)) return;
  const Cone cone(active, rays);
  for (std::size_t packet = 0; packet < spheres_.size(); ++packet)
    for (unsigned met = bits_of(cone.meets(spheres_[packet])); met != 0; met &= met - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(met));
      const Ints lanes = meeting(active, rays, spheres_[packet], lane);
      if (any(lanes)) cast(lanes, moving_[packet * kLanes + lane]);
    }
}

namespace {

// The rays in the axes of a mesh; puts them back at its end.
class InMesh {
 public:
  InMesh(const Eigen::Matrix3f& R_WM, const Eigen::Vector3f& p_WM, RayPacket& rays)
      : rays_(rays),
        from_{load(rays.org_x), load(rays.org_y), load(rays.org_z)},
        along_{load(rays.dir_x), load(rays.dir_y), load(rays.dir_z)} {
    put(turned_back(R_WM, from_ - broadcast(p_WM)), turned_back(R_WM, along_));
  }
  InMesh(const InMesh&) = delete;
  InMesh& operator=(const InMesh&) = delete;
  ~InMesh() { put(from_, along_); }

 private:
  void put(const Floats3& from, const Floats3& along) {
    store(from.x, rays_.org_x);
    store(from.y, rays_.org_y);
    store(from.z, rays_.org_z);
    store(along.x, rays_.dir_x);
    store(along.y, rays_.dir_y);
    store(along.z, rays_.dir_z);
  }
  RayPacket& rays_;
  Floats3 from_, along_;
};

}  // namespace

void EmbreeScene::intersect(Ints active, RayHitPacket& rays) const {
  active &= castable(rays.ray);
  IntersectQuery query = IntersectQuery::coherent();
  query.intersect(reinterpret_cast<const int*>(&active), still_.get(), &rays);
  for_each_met(active, rays.ray, [&](Ints lanes, const Moving& moving) {
    const Ints before = load(rays.hit.geomID);
    store(~Ints{}, rays.hit.geomID);
    {
      const InMesh in_mesh(moving.R_WM, moving.p_WM, rays.ray);
      query.intersect(reinterpret_cast<const int*>(&lanes), moving.mesh, &rays);
    }
    const Ints hit = load(rays.hit.geomID) != -1;
    store(hit ? static_cast<std::int32_t>(moving.item) + Ints{} : before, rays.hit.geomID);
    store(hit ? Ints{} : load(rays.hit.instID[0]), rays.hit.instID[0]);
  });
}

void EmbreeScene::occlude(Ints active, RayPacket& rays) const {
  // Not coherent: Embree 3.13 did not return from coherent packets of shadow rays through instances, and without
  // instances it costs the same.
  active &= castable(rays);
  OccludeQuery query;
  query.occlude(reinterpret_cast<const int*>(&active), still_.get(), &rays);
  active &= load(rays.tfar) >= 0.0F;
  for_each_met(active, rays, [&](Ints lanes, const Moving& moving) {
    const InMesh in_mesh(moving.R_WM, moving.p_WM, rays);
    query.occlude(reinterpret_cast<const int*>(&lanes), moving.mesh, &rays);
  });
}

bool EmbreeScene::occluded(RTCRay ray) const {
  for (const float value : {ray.org_x, ray.org_y, ray.org_z, ray.dir_x, ray.dir_y, ray.dir_z})
    if (!(std::abs(value) < kFurthest)) return false;
  OccludeQuery query;
  query.occlude(still_.get(), &ray);
  const Eigen::Vector3f from(ray.org_x, ray.org_y, ray.org_z), along(ray.dir_x, ray.dir_y, ray.dir_z);
  for (std::size_t i = 0; i < moving_.size() && ray.tfar >= 0; ++i) {
    const Moving& moving = moving_[i];
    const Eigen::Vector3f from_M = moving.R_WM.transpose() * (from - moving.p_WM),
                          along_M = moving.R_WM.transpose() * along;
    Eigen::Map<Eigen::Vector3f>(&ray.org_x) = from_M;
    Eigen::Map<Eigen::Vector3f>(&ray.dir_x) = along_M;
    query.occlude(moving.mesh, &ray);
  }
  return ray.tfar < 0;
}

}  // namespace doppel::embree
