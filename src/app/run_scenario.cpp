#include "app/run_scenario.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "app/output.h"
#include "app/print_stderr.h"
#include "doppel/base/core/installation.h"
#include "doppel/lab/recording/run_files.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

// The options of `up` that a scenario file has the values of.
constexpr const char* kOptionsOfScenario[] = {
    "--set",    "--robot",   "--controllers",    "--activate",  "--no-controllers", "--world",
    "--engine", "--base",    "--ideal",          "--no-limits", "--strict",         "--stamp",
    "--seed",   "--sensors", "--sensor-threads", "--distro"};

fs::path folder_of(const std::string& file) {
  return file.empty() || file == "-" ? fs::current_path() : fs::absolute(file).parent_path();
}

}  // namespace

std::optional<Scenario> given_scenario(const std::vector<std::string>& words, const CLI::App& verb,
                                       const RosArguments& ros, const std::vector<std::string>& plugins,
                                       Diagnostics& diagnostics) {
  if (words.empty() || !is_scenario_file(words.front())) return std::nullopt;
  const std::string& file = words.front();
  const auto refuse = [&file](const std::string& argument) {
    throw InputError("cli.scenario", make_location(file),
                     argument + " beside a scenario, which has its own values",
                     "edit the scenario file, or start its robot with options and --write-scenario FILE");
  };
  if (words.size() > 1) refuse(fmt::format("'{}' is given", words[1]));
  for (const char* const option : kOptionsOfScenario) {
    if (verb.count(option) > 0) refuse(fmt::format("{} is given", option));
  }
  if (!ros.empty()) refuse("--ros-args is given");
  ScenarioFile read = load_scenario(file, data_folder() / "robots", plugins);
  report_changed_files(read, diagnostics);
  return std::move(read.scenario);
}

void add_write_scenario(CLI::App& verb, std::string& file) {
  verb.add_option(
          "--write-scenario", file,
          "Write what would run as a scenario file, with every choice that was made (.yaml, .json; - for "
          "stdout), and end; 'doppel up FILE' starts it")
      ->type_name("FILE");
}

void write_scenario(const Twin& twin, const std::string& file) {
  const Scenario scenario = twin.complete_scenario();
  const std::vector<ReadFile> files = files_of_run(twin);
  std::vector<fs::path> sources;
  for (const ReadFile& one : files) sources.push_back(one.file);
  if (file != "-") refuse_own_source(file, sources, "write the scenario to another file");
  const bool json = fs::path(file).extension() == ".json";
  const fs::path folder = folder_of(file);
  deliver(scenario_text(scenario, files, folder, json ? ScenarioFormat::json : ScenarioFormat::yaml), file);
  if (file != "-")
    print_stderr("{}: content hash {} of {} files\n", file, content_hash(scenario, files, folder),
                 files.size());
}

std::string content_hash_text(const Twin& twin, const std::string& scenario_file) {
  const Scenario scenario = twin.complete_scenario();
  const std::vector<ReadFile> files = files_of_run(twin);
  return fmt::format("{} of {} files", content_hash(scenario, files, folder_of(scenario_file)), files.size());
}

}  // namespace doppel::app
