#pragma once
// The scene of the benchmarks of rays: a room without a roof, with furniture, 40 bodies that move in every frame, and a
// sun with shadows; and what doppel's casts of it cost.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <random>

#include "doppel/sensors/models/lens.h"
#include "doppel/sensors/models/noise.h"
#include "doppel/sensors/models/scan_pattern.h"
#include "doppel/sensors/render/ray_caster.h"
#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
inline constexpr int kBodies = 40;

inline double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

inline double median(int frames, const std::function<void(int)>& frame) {
  frame(0);
  frame(1);
  std::vector<double> times;
  for (int i = 0; i < frames; ++i) {
    const double before = cpu_ms();
    frame(i + 2);
    times.push_back(cpu_ms() - before);
  }
  std::nth_element(times.begin(), times.begin() + frames / 2, times.end());
  return times[static_cast<std::size_t>(frames) / 2];
}

// A bumpy ball with about this many triangles.
inline MeshAppearance ball(int triangles) {
  const int rows = std::max(3, static_cast<int>(std::sqrt(triangles / 4.0))), columns = 2 * rows;
  std::vector<Eigen::Vector3f> points;
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const double a = M_PI * r / rows, b = 2 * M_PI * c / columns,
                   radius = 0.15 * (1 + 0.05 * std::sin(9 * a) * std::cos(7 * b));
      points.emplace_back(Eigen::Vector3d(radius * std::sin(a) * std::cos(b),
                                          radius * std::sin(a) * std::sin(b), radius * std::cos(a))
                              .cast<float>());
    }
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const auto at = [&](int row, int column) {
        return static_cast<std::uint32_t>(row * columns + column % columns);
      };
      faces.push_back({at(r, c), at(r + 1, c), at(r + 1, c + 1)});
      faces.push_back({at(r, c), at(r + 1, c + 1), at(r, c + 1)});
    }
  return {with_normals(points, faces, 0.7), {}, {}, {}};
}

// A floor of 10 m x 10 m with walls of 4 m, into which the sun shines.
inline SurfaceMesh room() {
  std::vector<Eigen::Vector3f> points;
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (const float z : {0.0F, 4.0F})
    for (const auto& [x, y] : {std::pair{-5.0F, -5.0F}, {5.0F, -5.0F}, {5.0F, 5.0F}, {-5.0F, 5.0F}})
      points.emplace_back(x, y, z);
  faces = {{0, 1, 2}, {0, 2, 3}};
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t j = (i + 1) % 4;
    faces.push_back({i, i + 4, j + 4});
    faces.push_back({i, j + 4, j});
  }
  return with_normals(points, faces, 0.7);
}

struct RayBench {
  std::shared_ptr<const RenderScene> scene;
  std::unique_ptr<RayCaster> caster;
  std::vector<Pose> poses;
  std::size_t triangles = 0;

  explicit RayBench(int wanted) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    RenderScene made;
    made.materials.resize(5);
    for (std::size_t m = 0; m < 5; ++m)
      made.materials[m].rgba = Eigen::Vector4f(0.3F + 0.15F * static_cast<float>(m), 0.8F,
                                               0.9F - 0.15F * static_cast<float>(m), 1);
    made.meshes.push_back(std::make_shared<SurfaceMesh>(room()));
    made.meshes.push_back(std::make_shared<SurfaceMesh>(ball(wanted / (2 * kBodies)).mesh));
    made.bodies.resize(kBodies + 1);
    made.items.push_back({0, 0, 0, Pose::Identity(), 1});
    for (int i = 0; i < kBodies; ++i) {
      Pose still = Pose::Identity();
      still.translation() = Eigen::Vector3d(3 * uniform(random), 3 * uniform(random), 0.3);
      made.items.push_back({1, 0, 1 + i % 4, still, static_cast<std::uint32_t>(2 + i)});
      made.items.push_back({1, 1 + i, 1 + i % 4, Pose::Identity(), static_cast<std::uint32_t>(100 + i)});
    }
    Light sun;
    sun.kind = LightKind::directional;
    sun.direction_W = {0.2, 0.3, -1};
    sun.cast_shadows = true;
    made.lights.push_back(sun);
    for (const SceneItem& item : made.items)
      triangles += made.meshes[static_cast<std::size_t>(item.mesh)]->triangles.size();
    scene = std::make_shared<const RenderScene>(std::move(made));
    caster = make_ray_caster(scene);
    poses.assign(kBodies + 1, Pose::Identity());
    move(0);
  }

  // Poses of the bodies in this frame.
  void place(int frame) {
    for (int i = 0; i < kBodies; ++i) {
      const double a = 0.15 * i + 0.01 * frame;
      poses[static_cast<std::size_t>(i + 1)].translation() =
          Eigen::Vector3d(2.5 * std::cos(a), 2.5 * std::sin(1.7 * a), 0.5 + 0.02 * i);
    }
  }
  void move(int frame) {
    place(frame);
    caster->set_poses(poses);
  }
};

inline CameraDescription camera_of(int width, int height) {
  CameraDescription camera;
  camera.width = width;
  camera.height = height;
  return camera;
}

inline PixelRays pinhole(int width, int height) {
  return pixel_rays(intrinsics_of(camera_of(width, height)), 1).front();
}

inline Pose from_corner() {
  Pose X = Pose::Identity();
  const Eigen::Vector3d z = Eigen::Vector3d(4, 4, -1.6).normalized(),
                        x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  X.linear() << x, z.cross(x), z;
  X.translation() = Eigen::Vector3d(-4, -4, 2.2);
  return X;
}

// A scan in the middle of the room, with noise: as the sensor measures it.
class ScanBench {
 public:
  ScanBench(RayBench& bench, int rings, int columns)
      : bench_(bench),
        lidar_(lidar_of(rings, columns)),
        pattern_(scan_pattern(lidar_)),
        noise_(lidar_.noise, CounterRandom(1, "lidar"), 0, 0.1) {
    X_WS_.translation().z() = 1;
  }
  [[nodiscard]] const ScanPattern& pattern() const { return pattern_; }
  [[nodiscard]] const Pose& X_WS() const { return X_WS_; }
  void scan(int frame) {
    place_rays(pattern_, {X_WS_}, Pose::Identity(), 0, rays_);
    rays_.near = static_cast<float>(lidar_.near);
    rays_.far = static_cast<float>(lidar_.far);
    bench_.caster->cast(rays_, hits_);
    if (bench_.caster->may_be_near(X_WS_.translation(), lidar_.near, -1)) std::abort();
    noise_.apply(hits_.distance, static_cast<std::uint64_t>(frame), scratch_);
  }

 private:
  static LidarDescription lidar_of(int rings, int columns) {
    LidarDescription out;
    out.horizontal = {columns, 1, -M_PI, M_PI};
    if (rings > 1) out.vertical = {rings, 1, -0.4, 0.2};
    out.noise.stddev = 0.01;
    return out;
  }

  RayBench& bench_;
  LidarDescription lidar_;
  ScanPattern pattern_;
  ChannelNoise noise_;
  Pose X_WS_ = Pose::Identity();
  RayBatch rays_;
  HitBatch hits_;
  std::vector<float> scratch_;
};

}  // namespace doppel
