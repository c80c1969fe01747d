#include "app/launch.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <system_error>

#include "app/description_target.h"
#include "app/launched_programs.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/run_twin.h"
#include "app/view.h"
#include "doppel/base/core/installation.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/base/packages/package_index.h"
#include "doppel/scenario/launch/launch_plan.h"
#include "doppel/scenario/launch/read_launch.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct LaunchOptions {
  std::vector<std::string> words;
  bool show = false, show_arguments = false, no_programs = false;
  std::string engine = kDefaultEngine;
  RunOptions run;
};

// The files that a launch file makes. Those of a written scenario stay beside it.
class LaunchFolder {
 public:
  explicit LaunchFolder(const std::string& scenario) {
    if (!scenario.empty() && scenario != "-") {
      path_ = fs::absolute(scenario).replace_extension("") += "_files";
      kept_ = true;
      fs::create_directories(path_);
      return;
    }
    std::string pattern = (fs::temp_directory_path() / "doppel-launch-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr)
      throw std::system_error(errno, std::generic_category(), "cannot make a folder in " + pattern);
    path_ = pattern;
  }
  ~LaunchFolder() {
    std::error_code none;
    if (kept_) {
      if (fs::is_empty(path_, none)) fs::remove(path_, none);
    } else {
      fs::remove_all(path_, none);
    }
  }
  LaunchFolder(const LaunchFolder&) = delete;
  LaunchFolder& operator=(const LaunchFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  bool kept_ = false;
};

struct LaunchCommand {
  std::string word, file;
  NamedTexts arguments;
};

LaunchCommand command_of(const std::vector<std::string>& words) {
  LaunchCommand out;
  for (const std::string& word : words) {
    const std::size_t separator = word.find(":=");
    if (separator != std::string::npos) {
      out.arguments.emplace_back(word.substr(0, separator), word.substr(separator + 2));
    } else if (out.word.empty()) {
      out.word = word;
    } else if (out.file.empty() && out.arguments.empty()) {
      out.file = word;
    } else {
      throw InputError("cli.use", {}, fmt::format("'{}' is neither a launch file nor name:=value", word),
                       "doppel launch FILE name:=value, or doppel launch PACKAGE FILE name:=value");
    }
  }
  return out;
}

std::string arguments_text(const LaunchDescription& description, const fs::path& file) {
  if (description.arguments.empty()) return shown_path(file) + " has no arguments\n";
  std::string out;
  for (const LaunchArgument& one : description.arguments) {
    out += fmt::format("{}:={}", one.name, one.value);
    if (!one.choices.empty()) out += fmt::format("  one of {}", fmt::join(one.choices, ", "));
    out += "\n";
    if (!one.description.empty()) out += fmt::format("    {}\n", one.description);
  }
  return out;
}

// "14 actions: 9 in the twin, 1 program beside it, 2 not here, 1 not known"
std::string summary_text(const LaunchPlan& plan) {
  std::map<LaunchFate, int> counts;
  for (const auto& [id, outcome] : plan.outcomes) ++counts[outcome.fate];
  std::string out = fmt::format("{} in the twin", counts[LaunchFate::taken]);
  const auto add = [&](LaunchFate fate, const char* text) {
    if (counts[fate] > 0) out += fmt::format(", {} {}", counts[fate], text);
  };
  add(LaunchFate::started, counts[LaunchFate::started] == 1 ? "program beside it" : "programs beside it");
  add(LaunchFate::absent, "not a part of doppel");
  add(LaunchFate::not_found, "not on this machine");
  add(LaunchFate::unknown, "not known");
  return out;
}

// package:// of descriptions that are in no package, because the launch file has made them.
void add_packages_of(const fs::path& file) {
  const char* before = std::getenv("ROS_PACKAGE_PATH");
  std::string path = before == nullptr ? "" : before;
  for (const fs::path& folder : folders_to_crawl(file)) path += (path.empty() ? "" : ":") + folder.string();
  setenv("ROS_PACKAGE_PATH", path.c_str(), 1);
}

[[noreturn]] void refuse_without_robot(const fs::path& file, const LaunchPlan& plan) {
  std::vector<Diagnostic> all = plan.diagnostics.all();
  const std::string show = fmt::format("'doppel launch {} --show' prints what it starts", shown_path(file));
  all.push_back(
      plan.needs_description
          ? Diagnostic{Severity::error, "launch.no_description",
                       "this launch file starts parts of a robot, but its description is loaded by another "
                       "one",
                       make_location(file.string()),
                       "start the launch file that includes this one and sets robot_description; " + show}
          : Diagnostic{Severity::error, "launch.no_robot",
                       "this launch file starts no robot that doppel can find", make_location(file.string()),
                       show + "; 'doppel up TARGET' starts a robot"});
  throw InputError(std::move(all));
}

int run_launch(const LaunchOptions& options) {
  check_run_options(options.run);
  const LaunchCommand command = command_of(options.words);
  PackageResolver resolver;
  resolver.add_bundled(data_folder() / "robots");
  const fs::path file = find_launch_file(command.word, command.file, resolver);
  const LaunchFolder folder(options.run.write_scenario);
  const LaunchDescription description = read_launch(file, command.arguments, resolver, folder.path());
  if (options.show_arguments) {
    deliver(arguments_text(description, file));
    return 0;
  }
  LaunchPlan plan = plan_launch(description, resolver, folder.path());
  Diagnostics diagnostics;
  for (const Diagnostic& one : description.diagnostics.all()) diagnostics.add(one);
  for (const Diagnostic& one : plan.diagnostics.all()) diagnostics.add(one);
  if (options.show) {
    print_diagnostics(diagnostics, true, kFewOfRule);
    deliver(launch_tree(description, plan, file.parent_path()));
    return 0;
  }
  if (plan.scenario.robots.empty() && !plan.scenario.world) refuse_without_robot(file, plan);
  add_packages_of(file);
  plan.scenario.engine = options.engine;
  plan.scenario.bundled_robots = data_folder() / "robots";
  print_stderr("{}: {} ({})\n", shown_path(file), summary_text(plan), "--show prints the tree");
  LaunchedPrograms programs(options.no_programs ? std::vector<LaunchedProgram>{} : plan.programs);
  RunHooks hooks;
  hooks.ready = [&](const StartedRun& run) { programs.begin(run); };
  hooks.ended = [&] { programs.end(); };
  if (plan.physics || !options.run.write_scenario.empty())
    return run_twin(plan.scenario, options.run, diagnostics, hooks);
  return show_robot(plan.scenario,
                    {.no_reload = options.run.no_reload,
                     .headless = options.run.headless,
                     .duration = options.run.duration,
                     .edges = options.run.edges},
                    diagnostics, hooks);
}

constexpr const char* kExamples =
    "Nothing of ROS is needed. Robots, controllers, worlds and fixed transforms become one scenario; your "
    "own nodes "
    "are started beside it where they are built, when the twin is ready.\n"
    "Examples:\n"
    "  doppel launch my_robot.launch.py\n"
    "  doppel launch my_robot_bringup sim.launch.py use_rviz:=false   # a package of the workspace\n"
    "  doppel launch display.launch --show                            # what it starts, and what that "
    "becomes\n"
    "  doppel launch my_robot.launch.xml --show-args\n"
    "  doppel launch sim.launch.py --write-scenario run.yaml          # then: doppel up run.yaml\n"
    "  doppel launch sim.launch.py --headless --duration 10 --speed max --json";

}  // namespace

void add_launch(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<LaunchOptions>();
  CLI::App* launch = app.add_subcommand("launch", "Start what a launch file of ROS 2 or ROS 1 describes");
  launch
      ->add_option(
          "FILE", options->words,
          "A launch file (.launch.py, .launch.xml, .launch.yaml, .launch), or a package and a launch "
          "file of it, and its arguments as name:=value")
      ->required();
  launch->add_flag("--show", options->show,
                   "Print the tree of what it describes and what became of each, and end");
  launch->add_flag("-s,--show-args", options->show_arguments, "Print its arguments, and end");
  launch->add_flag("--no-programs", options->no_programs, "Do not start the user's own nodes and commands");
  launch->add_option("--engine", options->engine, "Physics engine; 'doppel engines' lists the available ones")
      ->capture_default_str();
  add_run_options(*launch, options->run);
  launch->footer(kExamples);
  launch->callback([options, &exit_code] { exit_code = run_launch(*options); });
}

}  // namespace doppel::app
