// doppel validate as its users run it, in a process of its own each time: medians of the standard suite (goal
// 60 s), of --quick (10 s) and with `full` of --full (600 s); whether results are the same for 1 and 8 jobs.
// build/bin/bench_validate [repetitions] [full] [TARGET...]
// With `rates` instead of times: of T1 the share of 10,000 poses that inverse kinematics reaches (goal
// 99.9 %, of arms with fewer than six joints 99.5 %) and its mean time (1 ms), of T3 the configurations in a
// second by hulls (20,000) and triangles (2,000), on one thread; without targets the bundled robots, and
// four public arms where they are there.
#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "validate_rates.h"

namespace {

const std::vector<std::string> kBundled = {"omarm_one", "omarm_zero", "lab_arm", "kate"};
// They are in the collection of public robots beside the checkout.
constexpr const char* kPublic[] = {"staubli/staubli_rx160_support/urdf/rx160.xacro",
                                   "fanuc/fanuc_lrmate200id_support/urdf/lrmate200id.xacro",
                                   "tmr_ros2/tm_description/xacro/tm5-900.urdf.xacro",
                                   "SO-ARM100/Simulation/SO101/so101_new_calib.urdf"};

using Clock = std::chrono::steady_clock;

struct Outcome {
  double seconds = 0;
  int code = 0;
};

Outcome run(const std::string& target, const std::string& options) {
  const std::string command =
      fmt::format("'{}' validate '{}' --no-write -q {} > /dev/null 2>&1", DOPPEL_PROGRAM, target, options);
  const auto begin = Clock::now();
  const int status = std::system(command.c_str());
  return {std::chrono::duration<double>(Clock::now() - begin).count(), WEXITSTATUS(status)};
}

Outcome median_of(const std::string& target, const std::string& options, int repetitions) {
  std::vector<double> seconds;
  Outcome out;
  for (int i = 0; i < repetitions; ++i) {
    out = run(target, options);
    seconds.push_back(out.seconds);
  }
  std::ranges::sort(seconds);
  out.seconds = seconds[seconds.size() / 2];
  return out;
}

int run_rates(std::vector<std::string> targets) {
  if (targets.empty()) {
    targets = kBundled;
    const std::filesystem::path corpus = std::filesystem::path(DOPPEL_ROBOTS) / "../../shared/corpus/robots";
    for (const char* const arm : kPublic)
      if (std::filesystem::exists(corpus / arm)) targets.push_back((corpus / arm).string());
  }
  try {
    doppel::bench::print_rates(targets);
  } catch (const doppel::InputError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return 0;
}

// The results without their times.
std::string results_of(const std::string& target, int jobs) {
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "bench_validate.json";
  run(target, fmt::format("-j {} --json '{}'", jobs, file.string()));
  std::ifstream stream(file);
  nlohmann::ordered_json out = nlohmann::ordered_json::parse(stream, nullptr, false);
  out.erase("timing");
  std::filesystem::remove(file);
  return out.dump();
}

}  // namespace

int main(int count, char** words) {
  std::vector<std::string> targets(words + 1, words + count);
  int repetitions = 5;
  if (!targets.empty() && std::atoi(targets.front().c_str()) > 0) {
    repetitions = std::atoi(targets.front().c_str());
    targets.erase(targets.begin());
  }
  const bool full = std::erase(targets, "full") > 0;
  if (std::erase(targets, "rates") > 0) return run_rates(targets);
  if (targets.empty()) targets = kBundled;
  fmt::print("{:<28} {:>10} {:>10} {:>10}   {}\n", "medians, s", "standard", "--quick", full ? "--full" : "",
             "same bytes for 1 and 8 jobs");
  for (const std::string& target : targets) {
    const Outcome standard = median_of(target, "", repetitions),
                  quick = median_of(target, "--quick", repetitions);
    const std::string long_run = full ? fmt::format("{:.1f}", run(target, "--full").seconds) : "";
    fmt::print("{:<28} {:>10.2f} {:>10.2f} {:>10}   {}   exit code {}\n",
               target.substr(target.rfind('/') + 1), standard.seconds, quick.seconds, long_run,
               results_of(target, 1) == results_of(target, 8) ? "yes" : "NO", standard.code);
    std::fflush(stdout);
  }
  return 0;
}
