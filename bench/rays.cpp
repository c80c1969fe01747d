// The cost of a picture and of a scan: CPU time of the process per frame, median of --frames, one thread.
//
//   build/bin/bench_rays [--frames 15]
//
// bench_rays_peers compares it with other renderers of the same scene.
#include <fmt/format.h>

#include <cstdlib>
#include <string>

#include "rays_scene.h"

namespace doppel {
namespace {

void print(const std::string& what, double ms, double goal) {
  fmt::print("  {:<34} {:8.3f} ms   goal {:6.2f}   {}\n", what, ms, goal, ms <= goal ? "met" : "MISSED");
}

void picture(RayBench& bench, int frames, int width, int height, bool depth, bool colour, double goal) {
  const PixelRays pixels = pinhole(width, height);
  CameraPicture out;
  const double ms = median(frames, [&](int i) {
    bench.move(i);
    bench.caster->render({{&pixels, 1}, from_corner(), 0.05, 50, colour, depth, depth && colour}, out);
  });
  const std::string what = !colour ? "depth" : depth ? "colour, shadow, depth, ids" : "colour, shadow";
  print(fmt::format("{} {}x{}", what, width, height), ms, goal);
}

void heading(const RayBench& bench) {
  fmt::print("{} triangles, {} moving bodies\n", bench.triangles, kBodies);
}

void run(int frames) {
  for (const auto& [triangles, goal] : {std::pair{2'000, 4.0}, {1'000'000, 20.0}}) {
    RayBench bench(triangles);
    heading(bench);
    picture(bench, frames, 320, 240, false, true, goal);
  }
  RayBench bench(100'000);
  heading(bench);
  print("moving the bodies", median(frames, [&](int i) { bench.move(i); }), 0.1);
  picture(bench, frames, 320, 240, true, false, 6);
  picture(bench, frames, 640, 480, true, false, 18);
  picture(bench, frames, 320, 240, true, true, 12);
  picture(bench, frames, 640, 480, true, true, 45);
  ScanBench line(bench, 1, 720), cloud(bench, 64, 1024);
  print("lidar 720, with noise", median(frames, [&](int i) { line.scan(i); }), 0.15);
  print("lidar 64x1024, with noise", median(frames, [&](int i) { cloud.scan(i); }), 4);
}

}  // namespace
}  // namespace doppel

int main(int argc, char** argv) {
  doppel::run(argc == 3 && std::string(argv[1]) == "--frames" ? std::atoi(argv[2]) : 15);
  return 0;
}
