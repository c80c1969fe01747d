// Pictures and scans of doppel beside those of MuJoCo and of plain OpenGL 3.3 on llvmpipe, of the same scene, in turn:
// CPU time of the process with all its threads per frame, medians of --frames.
//
//   build/bin/bench_rays_peers [--frames 5]
//
// It is built if libegl-dev, libgl-dev and libmujoco-dev are installed; libgl1-mesa-dri has llvmpipe.
#include "rays_peers.h"

#include <fmt/format.h>

#include <cstdlib>
#include <numeric>
#include <stdexcept>
#include <string>

#include "reference_renderer.h"

namespace doppel {
namespace {

void print(const std::string& what, double own, double goal, double mujoco, double gl) {
  fmt::print("{:<34} {:9.3f} {:7.2f} {:10.2f} {:7.1f}x", what, own, goal, mujoco, mujoco / own);
  if (gl > 0) fmt::print(" {:9.2f} {:7.1f}x", gl, gl / own);
  fmt::print("\n");
}

template <class Value>
double mean_of(const std::vector<Value>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Of the pixels, the part whose labels are those of another picture.
double same_labels(const CameraPicture& a, const CameraPicture& b) {
  std::size_t same = 0;
  for (std::size_t i = 0; i < a.labels.size(); ++i) same += a.labels[i] == b.labels[i] ? 1 : 0;
  return static_cast<double>(same) / static_cast<double>(a.labels.size());
}

struct What {
  const char* name;
  bool colour, depth, labels;
};
constexpr What kColour{"colour, shadow", true, false, false}, kDepth{"depth", false, true, false},
    kAll{"colour, shadow, depth, ids", true, true, true};

void compare_pictures(RayBench& bench, int frames, MujocoPeer& mujoco, CameraRenderer& gl, int width,
                      int height, const What& what, double goal) {
  const PixelRays pixels = pinhole(width, height);
  const CameraView view{{&pixels, 1}, from_corner(), 0.05, 50, what.colour, what.depth, what.labels};
  CameraRenderer* const renderers[] = {bench.caster.get(), &mujoco, &gl};
  double ms[3];
  CameraPicture pictures[3];
  for (int r = 0; r < 3; ++r)
    ms[r] = median(frames, [&](int i) {
      bench.place(i);
      renderers[r]->set_poses(bench.poses);
      renderers[r]->render(view, pictures[r]);
    });
  print(fmt::format("{} {}x{}", what.name, width, height), ms[0], goal, ms[1], ms[2]);
  if (what.colour)
    fmt::print("    mean of the colours, 0 to 255: {:.1f}, MuJoCo {:.1f}, GL {:.1f}\n",
               mean_of(pictures[0].rgb), mean_of(pictures[1].rgb), mean_of(pictures[2].rgb));
  if (!what.depth) return;
  fmt::print("    mean depth, m: {:.3f}, MuJoCo {:.3f}, GL {:.3f}\n", mean_of(pictures[0].depth),
             mean_of(pictures[1].depth), mean_of(pictures[2].depth));
  if (!what.labels) return;
  ReferenceRenderer reference(bench.scene);
  CameraPicture expected;
  reference.set_poses(bench.poses);
  reference.render({view.samples, view.X_WC, view.near, view.far, false, false, true}, expected);
  fmt::print("    same ids as in double precision: {:.2f} % of the pixels, GL {:.2f} %\n",
             100 * same_labels(pictures[0], expected), 100 * same_labels(pictures[2], expected));
}

void compare_scans(RayBench& bench, int frames, MujocoPeer& mujoco, int rings, int columns, double goal) {
  ScanBench scan(bench, rings, columns);
  std::vector<double> distances;
  bench.move(0);
  const double own = median(frames, [&](int i) { scan.scan(i); });
  const double peer = median(rings > 1 ? 1 : frames, [&](int) {
    mujoco.set_poses(bench.poses);
    mujoco.scan(scan.pattern(), scan.X_WS(), distances);
  });
  print(fmt::format("lidar {}x{}", rings, columns), own, goal, peer, 0);
}

void heading(const RayBench& bench) {
  fmt::print("{} triangles, {} moving bodies, CPU ms\n", bench.triangles, kBodies);
  fmt::print("{:<34} {:>9} {:>7} {:>10} {:>8} {:>9} {:>8}\n", "", "doppel", "goal", "MuJoCo", "ratio",
             "GL 3.3", "ratio");
}

void run(int frames) {
  for (const auto& [triangles, goal] : {std::pair{2'000, 4.0}, {1'000'000, 20.0}}) {
    RayBench bench(triangles);
    heading(bench);
    compare_pictures(bench, frames, *make_mujoco_peer(*bench.scene), *make_gl_peer(bench.scene), 320, 240,
                     kColour, goal);
  }
  RayBench bench(100'000);
  const auto mujoco = make_mujoco_peer(*bench.scene);
  const auto gl = make_gl_peer(bench.scene);
  heading(bench);
  compare_pictures(bench, frames, *mujoco, *gl, 320, 240, kDepth, 6);
  compare_pictures(bench, frames, *mujoco, *gl, 640, 480, kDepth, 18);
  compare_pictures(bench, frames, *mujoco, *gl, 320, 240, kAll, 12);
  compare_pictures(bench, frames, *mujoco, *gl, 640, 480, kAll, 45);
  compare_scans(bench, frames, *mujoco, 1, 720, 0.15);
  compare_scans(bench, frames, *mujoco, 64, 1024, 4);
}

}  // namespace

PinholeLens::PinholeLens(const CameraView& view) {
  const PixelRays& rays = view.samples.front();
  width = rays.width;
  height = rays.height;
  const auto last = rays.x.size() - 1;
  focal = (width - 1) / static_cast<double>(rays.x[last] - rays.x[0]);
  cx = -focal * static_cast<double>(rays.x[0]);
  cy = -focal * static_cast<double>(rays.y[0]);
  for (std::size_t i = 0; i <= last; ++i) {
    const auto u = static_cast<double>(i % static_cast<std::size_t>(width)),
               v = static_cast<double>(i / static_cast<std::size_t>(width));
    if (rays.z[i] != 1 || std::abs(focal * static_cast<double>(rays.x[i]) + cx - u) > 0.01 ||
        std::abs(focal * static_cast<double>(rays.y[i]) + cy - v) > 0.01)
      throw std::runtime_error("a rasterizer can draw only pinhole cameras with square pixels");
  }
}

}  // namespace doppel

int main(int argc, char** argv) {
  try {
    doppel::run(argc == 3 && std::string(argv[1]) == "--frames" ? std::atoi(argv[2]) : 5);
  } catch (const std::runtime_error& error) {
    fmt::print(stderr, "bench_rays_peers: {}\n", error.what());
    return 1;
  }
  return 0;
}
