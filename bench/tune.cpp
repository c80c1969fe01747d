// bench_tune [TARGET ...]: time and verdict of `doppel tune` for all bundled robots, or for targets with
// their controllers' files: TARGET[=FILE.yaml].

#include "doppel/validation/tuning/tune.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

namespace {

void measure(const std::string& word) {
  doppel::Scenario scenario;
  scenario.bundled_robots = DOPPEL_ROBOTS;
  doppel::WorldRobot& robot = scenario.robots.emplace_back();
  const std::size_t sign = word.find('=');
  robot.target = word.substr(0, sign);
  if (sign != std::string::npos) robot.controllers = {word.substr(sign + 1)};
  const doppel::Subject subject = doppel::read_subject(scenario, {});
  if (!subject.refusal.empty()) {
    fmt::print("{:20} cannot be compiled\n", word);
    return;
  }
  doppel::TuneOptions options;
  options.jobs = std::max(1U, std::thread::hardware_concurrency());
  const doppel::TuneReport report = doppel::tune(subject, {}, options);
  std::size_t acting = 0;
  for (const doppel::TunedJoint& joint : report.joints) acting += joint.gains_act ? 1 : 0;
  fmt::print("{:20} {:2} joints, {:2} with gains that act, {:2} runs: {:6.2f} s, {}\n", word,
             report.joints.size(), acting, report.runs, report.seconds, report.passed() ? "passes" : "FAILS");
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty()) {
    for (const auto& entry : std::filesystem::directory_iterator(DOPPEL_ROBOTS))
      if (std::filesystem::exists(entry.path() / "package.xml"))
        words.push_back(entry.path().filename().string());
  }
  for (const std::string& word : words) {
    try {
      measure(word);
    } catch (const std::exception& e) {
      fmt::print("{:20} {}\n", word, e.what());
    }
  }
  return 0;
}
