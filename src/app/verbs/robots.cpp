// doppel robots: the robots that come with the program.
#include "app/verbs/robots.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>

#include "app/verbs/output.h"
#include "app/verbs/verbs.h"
#include "doppel/core/installation.h"

namespace doppel::app {

std::vector<std::string> bundled_robots() {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(data_folder() / "robots", none)) {
    if (std::filesystem::exists(entry.path() / "package.xml", none))
      names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

void add_robots(CLI::App& app, int& exit_code) {
  CLI::App* verb = app.add_subcommand("robots", "List the bundled robots");
  verb->footer("Example:\n  doppel robots");
  verb->callback([&exit_code] {
    std::string text;
    for (const std::string& name : bundled_robots()) text += name + "\n";
    deliver(text);
    exit_code = 0;
  });
}

}  // namespace doppel::app
