// The time in which SDF files are read: a world of 200 models with a folder each, and files that are given, each in a
// new reader so that nothing is remembered:  build/bin/bench_sdf [file ...]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <vector>

#include "doppel/scenario/sdf/sdf_world.h"

namespace {

namespace fs = std::filesystem;

constexpr int kModels = 200, kRuns = 5;

double milliseconds(const fs::path& file) {
  const auto begin = std::chrono::steady_clock::now();
  doppel::PackageResolver resolver;
  doppel::Diagnostics found;
  doppel::load_sdf(file, resolver, found);
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

double median_of_runs(const fs::path& file) {
  std::vector<double> times;
  for (int i = 0; i < kRuns; ++i) times.push_back(milliseconds(file));
  std::sort(times.begin(), times.end());
  return times[kRuns / 2];
}

fs::path make_world(const fs::path& folder) {
  fs::create_directories(folder);
  std::ofstream world(folder / "world.sdf");
  world << "<sdf version='1.9'><world name='many'>\n";
  for (int i = 0; i < kModels; ++i) {
    const fs::path model = folder / "models" / fmt::format("model_{}", i);
    fs::create_directories(model);
    std::ofstream(model / "model.config") << "<model><sdf version='1.9'>model.sdf</sdf></model>";
    std::ofstream text(model / "model.sdf");
    text << fmt::format("<sdf version='1.9'><model name='model_{}'>\n", i);
    for (int k = 0; k < 5; ++k) {
      text << fmt::format(
          "<link name='l{0}'><pose>{0} 0 0 0 0 "
          "0</pose><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy>"
          "<izz>1</izz></inertia></inertial><visual name='v'><geometry><box><size>1 1 "
          "1</size></box></geometry>"
          "<material><script><name>Gazebo/Grey</name></script></material></visual><collision "
          "name='c'><geometry><box>"
          "<size>1 1 1</size></box></geometry></collision></link>\n",
          k);
      if (k > 0) {
        text << fmt::format(
            "<joint name='j{0}' type='revolute'><parent>l{1}</parent><child>l{0}</child><axis><xyz>0 0 "
            "1</xyz></axis>"
            "</joint>\n",
            k, k - 1);
      }
    }
    text << "</model></sdf>\n";
    world << fmt::format("<include><uri>model://model_{0}</uri><pose>{0} 0 1 0 0 0</pose></include>\n", i);
  }
  world << "</world></sdf>\n";
  return folder / "world.sdf";
}

}  // namespace

int main(int argc, char** argv) {
  const fs::path folder = fs::temp_directory_path() / "doppel_bench_sdf";
  const fs::path world = make_world(folder);
  const double first = milliseconds(world);
  fmt::print("{} models in {} files: {:.1f} ms first, {:.1f} ms again\n", kModels, kModels, first,
             median_of_runs(world));
  fs::remove_all(folder);
  std::vector<double> times;
  int refused = 0;
  for (int i = 1; i < argc; ++i) {
    try {
      times.push_back(median_of_runs(argv[i]));
    } catch (const doppel::InputError&) {
      ++refused;
    }
  }
  if (times.empty()) return 0;
  std::sort(times.begin(), times.end());
  fmt::print("{} files: median {:.2f} ms, longest {:.1f} ms; {} refused\n", times.size(),
             times[times.size() / 2], times.back(), refused);
}
