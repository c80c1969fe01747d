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

namespace doppel {
namespace {

void print(const std::string& what, double own, double goal, double mujoco, double gl) {
  fmt::print("{:<34} {:9.3f} {:7.2f} {:10.2f} {:7.1f}x", what, own, goal, mujoco, mujoco / own);
  if (gl > 0) fmt::print(" {:9.2f} {:7.1f}x", gl, gl / own);
  fmt::print("\n");
}

void compare_pictures(RayBench& bench, int frames, MujocoPeer& mujoco, RayPeer& gl, const PeerView& view,
                      double goal) {
  const PixelRays pixels = pinhole(view.width, view.height);
  CameraPicture out;
  const double own = median(frames, [&](int i) {
    bench.move(i);
    bench.caster->render({{&pixels, 1}, from_corner(), 0.05, 50, view.colour, true, view.colour}, out);
  });
  const double of_mujoco = median(frames, [&](int i) {
    bench.place(i);
    mujoco.picture(view, bench.poses);
  });
  const double of_gl = median(frames, [&](int i) {
    bench.place(i);
    gl.picture(view, bench.poses);
  });
  print(
      fmt::format("{} {}x{}", view.colour ? "colour, shadow, depth, ids" : "depth", view.width, view.height),
      own, goal, of_mujoco, of_gl);
  const double depth =
      std::accumulate(out.depth.begin(), out.depth.end(), 0.0) / static_cast<double>(out.depth.size());
  fmt::print("    mean depth, m: {:.3f}, MuJoCo {:.3f}, GL {:.3f}\n", depth, mujoco.mean_depth(),
             gl.mean_depth());
}

void compare_scans(RayBench& bench, int frames, MujocoPeer& mujoco, int rings, int columns, double goal) {
  ScanBench scan(bench, rings, columns);
  std::vector<double> distances;
  bench.move(0);
  const double own = median(frames, [&](int i) { scan.scan(i); });
  const double peer = median(rings > 1 ? 1 : frames,
                             [&](int) { mujoco.scan(scan.pattern(), scan.X_WS(), bench.poses, distances); });
  print(fmt::format("lidar {}x{}", rings, columns), own, goal, peer, 0);
}

void run(int frames) {
  RayBench bench(100'000);
  bench.move(0);
  const auto mujoco = make_mujoco_peer(*bench.scene);
  const auto gl = make_gl_peer(*bench.scene);
  fmt::print("{} triangles, {} moving bodies, CPU ms\n", bench.triangles, kBodies);
  fmt::print("{:<34} {:>9} {:>7} {:>10} {:>8} {:>9} {:>8}\n", "", "doppel", "goal", "MuJoCo", "ratio",
             "GL 3.3", "ratio");
  compare_pictures(bench, frames, *mujoco, *gl, {320, 240, false}, 6);
  compare_pictures(bench, frames, *mujoco, *gl, {640, 480, false}, 18);
  compare_pictures(bench, frames, *mujoco, *gl, {320, 240, true}, 12);
  compare_pictures(bench, frames, *mujoco, *gl, {640, 480, true}, 45);
  compare_scans(bench, frames, *mujoco, 1, 720, 0.15);
  compare_scans(bench, frames, *mujoco, 64, 1024, 4);
}

}  // namespace
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
