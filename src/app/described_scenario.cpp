#include "app/described_scenario.h"

#include <CLI/CLI.hpp>

#include "app/description_target.h"
#include "app/process.h"
#include "doppel/base/core/installation.h"

namespace doppel::app {

void add_described_by(CLI::App& verb, DescribedBy& by, bool required) {
  add_target(verb, by.words, required);
  verb.add_option("--set", by.set, "xacro argument, name:=value")->take_all();
}

Scenario described_scenario(const DescribedBy& by) {
  Scenario scenario;
  if (!by.words.empty()) {
    WorldRobot& robot = scenario.robots.emplace_back();
    robot.target = by.words.front();
    for (std::size_t i = 1; i < by.words.size(); ++i) robot.arguments.push_back(split_argument(by.words[i]));
    for (const std::string& text : by.set) robot.arguments.push_back(split_argument(text));
  }
  scenario.bundled_robots = data_folder() / "robots";
  return scenario;
}

}  // namespace doppel::app
