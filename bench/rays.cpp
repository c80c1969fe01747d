// The cost of a picture and of a scan: CPU time of the process per frame, median of --frames, one thread.
//
//   build/bin/bench_rays [--frames 15]
//
// A room with furniture, 40 bodies that move in every frame, and a sun with shadows.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <random>
#include <string>

#include "doppel/rays/ray_caster.h"
#include "doppel/scene/scene_builder.h"
#include "doppel/sensors/lens.h"

namespace doppel {
namespace {

constexpr int kBodies = 40;

double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double median(int frames, const std::function<void(int)>& frame) {
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
MeshAppearance ball(int triangles) {
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

struct Bench {
  std::unique_ptr<RayCaster> caster;
  std::vector<Pose> poses;
  std::size_t triangles = 0;

  explicit Bench(int wanted) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    RenderScene scene;
    scene.materials.resize(5);
    for (std::size_t m = 0; m < 5; ++m)
      scene.materials[m].rgba = Eigen::Vector4f(0.3F + 0.15F * static_cast<float>(m), 0.8F,
                                                0.9F - 0.15F * static_cast<float>(m), 1);
    scene.meshes.push_back(std::make_shared<SurfaceMesh>(surface_of(Box{{10, 10, 4}})));
    scene.meshes.push_back(std::make_shared<SurfaceMesh>(ball(wanted / (2 * kBodies)).mesh));
    scene.bodies.resize(kBodies + 1);
    Pose up = Pose::Identity();
    up.translation().z() = 2;
    scene.items.push_back({0, 0, 0, up, 1});
    for (int i = 0; i < kBodies; ++i) {
      Pose still = Pose::Identity();
      still.translation() = Eigen::Vector3d(3 * uniform(random), 3 * uniform(random), 0.3);
      scene.items.push_back({1, 0, 1 + i % 4, still, static_cast<std::uint32_t>(2 + i)});
      scene.items.push_back({1, 1 + i, 1 + i % 4, Pose::Identity(), static_cast<std::uint32_t>(100 + i)});
    }
    Light sun;
    sun.kind = LightKind::directional;
    sun.direction_W = {0.2, 0.3, -1};
    sun.cast_shadows = true;
    scene.lights.push_back(sun);
    for (const SceneItem& item : scene.items)
      triangles += scene.meshes[static_cast<std::size_t>(item.mesh)]->triangles.size();
    caster = make_ray_caster(std::make_shared<const RenderScene>(std::move(scene)));
    poses.assign(kBodies + 1, Pose::Identity());
  }

  void move(int frame) {
    for (int i = 0; i < kBodies; ++i) {
      const double a = 0.15 * i + 0.01 * frame;
      poses[static_cast<std::size_t>(i + 1)].translation() =
          Eigen::Vector3d(2.5 * std::cos(a), 2.5 * std::sin(1.7 * a), 0.5 + 0.02 * i);
    }
    caster->set_poses(poses);
  }
};

PixelRays pinhole(int width, int height) {
  CameraDescription camera;
  camera.width = width;
  camera.height = height;
  return pixel_rays(intrinsics_of(camera), 1).front();
}

Pose from_corner() {
  Pose X = Pose::Identity();
  const Eigen::Vector3d z = Eigen::Vector3d(4, 4, -1.6).normalized(),
                        x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  X.linear() << x, z.cross(x), z;
  X.translation() = Eigen::Vector3d(-4, -4, 2.2);
  return X;
}

void pictures(int triangles, int frames) {
  Bench bench(triangles);
  fmt::print("{} triangles, {} moving bodies\n", bench.triangles, kBodies);
  fmt::print("  moving the bodies               {:8.3f} ms\n", median(frames, [&](int i) { bench.move(i); }));
  for (const auto& [width, height] : {std::pair{320, 240}, {640, 480}}) {
    const PixelRays pixels = pinhole(width, height);
    CameraPicture picture;
    for (const bool colour : {false, true}) {
      const double ms = median(frames, [&](int i) {
        bench.move(i);
        bench.caster->render({{&pixels, 1}, from_corner(), 0.05, 50, colour, true, colour}, picture);
      });
      fmt::print("  {:<31} {:8.3f} ms\n",
                 fmt::format("{} {}x{}", colour ? "colour, shadow, depth, ids" : "depth", width, height), ms);
    }
  }
}

void scans(int frames) {
  Bench bench(100'000);
  for (const auto& [rings, rays] : {std::pair{1, 720}, {64, 1024}}) {
    RayBatch batch;
    batch.resize(static_cast<std::size_t>(rings) * static_cast<std::size_t>(rays), 1);
    batch.far = 30;
    batch.origin_z[0] = 1;
    for (int r = 0; r < rings; ++r)
      for (int i = 0; i < rays; ++i) {
        const double a = 2 * M_PI * i / rays, e = rings == 1 ? 0 : -0.4 + 0.6 * r / rings;
        const auto at = static_cast<std::size_t>(r * rays + i);
        batch.direction_x[at] = static_cast<float>(std::cos(e) * std::cos(a));
        batch.direction_y[at] = static_cast<float>(std::cos(e) * std::sin(a));
        batch.direction_z[at] = static_cast<float>(std::sin(e));
      }
    HitBatch hits;
    bench.move(0);
    fmt::print("  lidar {:2} x {:4}                 {:8.3f} ms\n", rings, rays,
               median(frames, [&](int) { bench.caster->cast(batch, hits); }));
  }
}

}  // namespace
}  // namespace doppel

int main(int argc, char** argv) {
  const int frames = argc == 3 && std::string(argv[1]) == "--frames" ? std::atoi(argv[2]) : 15;
  for (const int triangles : {2'000, 100'000, 1'000'000}) doppel::pictures(triangles, frames);
  doppel::scans(frames);
  return 0;
}
