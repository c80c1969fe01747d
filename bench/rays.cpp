// The cost of a picture and of a scan: CPU time of the process per frame, median of --frames, one thread.
//
//   build/bin/bench_rays [--frames 15] [--only TEXT]
//
// bench_rays_peers compares it with other renderers of the same scene.
#include <fmt/format.h>

#include <cstdlib>
#include <string>

#include "doppel/sensors/models/coverage.h"
#include "rays_scene.h"

namespace doppel {
namespace {

struct Options {
  int frames = 15;
  std::string only;     // rows whose heading or name has it
  std::string heading;  // of the rows that follow
};

void print(const Options& options, const std::string& what, double goal,
           const std::function<void(int)>& frame) {
  if ((options.heading + what).find(options.only) == std::string::npos) return;
  const double ms = median(options.frames, frame);
  fmt::print("  {:<34} {:8.3f} ms   goal {:6.2f}   {}\n", what, ms, goal, ms <= goal ? "met" : "MISSED");
}

void picture(const Options& options, RayBench& bench, int width, int height, bool depth, bool colour,
             double goal) {
  const PixelRays pixels = pinhole(width, height);
  CameraPicture out;
  const std::string what = !colour ? "depth" : depth ? "colour, shadow, depth, ids" : "colour, shadow";
  print(options, fmt::format("{} {}x{}", what, width, height), goal, [&](int i) {
    bench.move(i);
    bench.caster->render({{&pixels, 1}, from_corner(), 0.05, 50, colour, depth, depth && colour}, out);
  });
}

// A workspace of 20 by 20 by 25 points before the camera: which of them it sees.
void coverage(const Options& options, RayBench& bench) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 10'000; ++i)
    points.emplace_back(from_corner() *
                        Eigen::Vector3d(0.2 * (i % 20) - 2, 0.1 * (i / 20 % 20) - 1, 1 + 0.2 * (i / 400)));
  const CameraIntrinsics camera = intrinsics_of(camera_of(640, 480));
  print(options, "coverage of 10,000 points", 5, [&](int i) {
    bench.move(i);
    static_cast<void>(camera_coverage(*bench.caster, camera, from_corner(), 0.05, 50, points));
  });
}

void heading(Options& options, const RayBench& bench) {
  options.heading = fmt::format("{} triangles, {} moving bodies\n", bench.triangles, kBodies);
  fmt::print("{}", options.heading);
}

void run(Options options) {
  for (const auto& [triangles, goal] : {std::pair{2'000, 4.0}, {1'000'000, 20.0}}) {
    RayBench bench(triangles);
    heading(options, bench);
    picture(options, bench, 320, 240, false, true, goal);
  }
  RayBench bench(100'000);
  heading(options, bench);
  print(options, "moving the bodies", 0.1, [&](int i) { bench.move(i); });
  picture(options, bench, 320, 240, true, false, 6);
  picture(options, bench, 640, 480, true, false, 18);
  picture(options, bench, 320, 240, true, true, 12);
  picture(options, bench, 640, 480, true, true, 45);
  ScanBench line(bench, 1, 720), cloud(bench, 64, 1024);
  print(options, "lidar 720, with noise", 0.15, [&](int i) { line.scan(i); });
  print(options, "lidar 64x1024, with noise", 4, [&](int i) { cloud.scan(i); });
  coverage(options, bench);
}

}  // namespace
}  // namespace doppel

int main(int argc, char** argv) {
  doppel::Options options;
  for (int i = 1; i + 1 < argc; i += 2)
    if (std::string(argv[i]) == "--frames")
      options.frames = std::atoi(argv[i + 1]);
    else
      options.only = argv[i + 1];
  doppel::run(options);
  return 0;
}
