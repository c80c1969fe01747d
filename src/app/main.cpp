#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "app/failures.h"
#include "app/print_stderr.h"
#include "app/process.h"
#include "app/up.h"
#include "app/verbs/verbs.h"
#include "app/view.h"
#include "doppel/bus/ros_arguments.h"
#include "doppel/core/diagnostic.h"
#include "doppel/core/names.h"
#include "doppel/ros2/environment.h"
#include "doppel/session/abandoned_thread.h"

namespace {

using doppel::app::kBadInput;

std::vector<std::string> bundled_robots() {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(doppel::app::root_folder() / "robots", none)) {
    if (std::filesystem::exists(entry.path() / "package.xml", none))
      names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

void add_robots(CLI::App& app) {
  app.add_subcommand("robots", "List the robots that come with doppel")->callback([] {
    for (const std::string& name : bundled_robots()) fmt::print("{}\n", name);
  });
}

// The verbs and options of `command` and of all below it, for completion: "topic echo --once".
void list_words(const CLI::App& command, const std::string& path) {
  for (const CLI::App* sub : command.get_subcommands([](const CLI::App*) { return true; })) {
    fmt::print("{} {}\n", path, sub->get_name());
    list_words(*sub, path + " " + sub->get_name());
  }
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) fmt::print("{} --{}\n", path, name);
  }
}

constexpr const char* kBashCompletion = R"sh(# doppel's completion for bash: source <(doppel completion)
_doppel() {
  local current=${COMP_WORDS[COMP_CWORD]} words=() word path=doppel remote=
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word == --remote ]] && remote=--remote
    [[ $word == -* ]] || words+=("$word")
  done
  local IFS=$'\n'
  case "${words[0]-} ${words[1]-}" in
    'up '*|'spawn '*|'view '*|'check '*|'tree '*|'info '*|'mass '*|'verify '*|'compare-engines '*|'convert '*|'diff '*|'calibrate '*|'xacro '*|'overlay '[a-z]*)
      mapfile -t COMPREPLY < <(compgen -W "$("${COMP_WORDS[0]}" robots)" -- "$current"; compgen -f -- "$current") ;;
    'topic echo'|'topic hz'|'topic info'|'topic type'|'topic bw'|'topic delay'|'topic pub')
      mapfile -t COMPREPLY < <(compgen -W "$("${COMP_WORDS[0]}" topic list $remote 2>/dev/null)" -- "$current") ;;
    'service call'|'service type')
      mapfile -t COMPREPLY < <(compgen -W "$("${COMP_WORDS[0]}" service list $remote 2>/dev/null)" -- "$current") ;;
  esac
  for word in "${words[@]:0:2}"; do path+=" $word"; done
  mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(
    "${COMP_WORDS[0]}" completion --words | while read -r line; do
      [[ $line == "$path "* ]] && line=${line#"$path "} && [[ $line != *' '* && $line == "$current"* ]] && echo "$line"
    done)
}
complete -o filenames -F _doppel doppel ./doppel
)sh";

void add_completion(CLI::App& app) {
  CLI::App* completion = app.add_subcommand("completion", "Completion for bash: source <(doppel completion)");
  auto words = std::make_shared<bool>(false);
  completion->add_flag("--words", *words, "List every verb and option, one path each");
  completion->callback([&app, words] {
    if (*words) {
      list_words(app, "doppel");
    } else {
      fmt::print("{}", kBashCompletion);
    }
  });
}

// CLI11's own message, and the nearest verb where the first word is none.
int report_usage(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words) {
  if (error.get_exit_code() == 0) return app.exit(error);
  const CLI::App* deepest = &app;
  std::string path = app.get_name();
  for (const std::string& word : words) {
    std::vector<std::string> names;
    const CLI::App* next = nullptr;
    for (const CLI::App* sub : deepest->get_subcommands([](const CLI::App*) { return true; })) {
      names.push_back(sub->get_name());
      if (sub->get_name() == word) next = sub;
    }
    if (next == nullptr) {
      if (!names.empty() && !word.starts_with('-')) {
        doppel::app::print_stderr("error: '{}' is no verb of {}{}\n", word, path,
                                  doppel::did_you_mean(word, names));
        return kBadInput;
      }
      break;
    }
    deepest = next;
    path += " " + next->get_name();
  }
  doppel::app::print_stderr("error: {}\n  fix: {} --help tells how it is used\n", error.what(), path);
  return kBadInput;
}

[[noreturn]] void refuse_ros_arguments(const std::string& verb) {
  throw doppel::InputError("cli.ros_args", {},
                           fmt::format("'{}' brings up no nodes, so --ros-args have nothing to act on", verb),
                           "give them to up or view");
}

// `doppel --remote VERB` and `doppel --ns ROBOT VERB` are for verbs that speak to somebody.
void refuse_elsewhere(const CLI::App& app, const char* option) {
  const CLI::App* verb = &app;
  std::string path;
  while (!verb->get_subcommands().empty()) {
    verb = verb->get_subcommands().front();
    path += (path.empty() ? "" : " ") + verb->get_name();
  }
  if (verb->get_option_no_throw(option) != nullptr) return;
  throw doppel::InputError("cli.use", {}, fmt::format("'{}' speaks to no ROS 2 graph", path),
                           fmt::format("leave {} away", option));
}

int run(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app("doppel turns a robot description into a digital twin.", "doppel");
  app.set_version_flag("--version", "doppel " DOPPEL_VERSION);
  app.require_subcommand(1);
  bool remote = false;
  app.add_flag("--remote", remote,
               "Speak to the ROS 2 graph of ROS_DOMAIN_ID instead of a twin: topic, node, ...");
  std::string name_space;
  app.add_option("--ns", name_space, "Speak to the robot in this namespace: topic, control, move, ...");
  app.parse_complete_callback([&] {
    if (remote) refuse_elsewhere(app, "--remote");
    if (!name_space.empty()) refuse_elsewhere(app, "--ns");
  });
  app.footer(
      "Start here:\n  doppel up omarm_one\nor, to look at a description without physics:\n  doppel view "
      "my_arm.urdf\nand from another shell:\n  doppel topic echo /joint_states");
  int exit_code = 0;
  doppel::RosArguments ros;  // of up and view
  doppel::app::add_up(app, ros, exit_code);
  doppel::app::add_view(app, ros, exit_code);
  doppel::app::add_verbs(app, exit_code);
  add_robots(app);
  add_completion(app);
  if (argc == 1) {
    fmt::print("{}", app.help());
    return 0;
  }
  std::vector<std::string> words(argv + 1, argv + argc);
  return doppel::app::with_failures_reported([&] {
    try {
      ros = doppel::take_ros_arguments(words);
      const std::string verb = words.empty() ? "doppel" : words.front();
      if (!ros.empty() && verb != "up" && verb != "view") refuse_ros_arguments(verb);
      app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
    } catch (const CLI::ParseError& error) {
      return report_usage(app, error, words);
    }
    return exit_code;
  });
}

}  // namespace

int main(int argc, char** argv) {
  doppel::app::fill_standard_files();
  doppel::ros2::forget_statistics();
  const int exit_code = run(argc, argv);
  if (doppel::has_abandoned_thread()) {
    std::fflush(nullptr);
    std::_Exit(exit_code);
  }
  return exit_code;
}
