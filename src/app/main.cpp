#include <fmt/format.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "app/documents.h"
#include "app/failures.h"
#include "app/launch.h"
#include "app/print_stderr.h"
#include "app/process.h"
#include "app/up.h"
#include "app/usage.h"
#include "app/view.h"
#include "doppel/base/core/abandoned_thread.h"
#include "doppel/base/core/allowed_pipes.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/plugin_module.h"
#include "doppel/ros/bus/ros_arguments.h"
#include "doppel/ros/network/environment.h"
#include "doppel/version.h"

namespace {

[[noreturn]] void refuse_ros_arguments(const std::string& verb) {
  throw doppel::InputError("cli.ros_args", {},
                           fmt::format("'{}' starts no nodes, so --ros-args have no effect", verb),
                           "pass them to up, view or teleop");
}

// `doppel --remote VERB` and `doppel --ns ROBOT VERB` are for verbs with a connection.
void refuse_elsewhere(const CLI::App& app, const char* option) {
  const CLI::App* verb = &app;
  std::string path;
  while (!verb->get_subcommands().empty()) {
    verb = verb->get_subcommands().front();
    path += (path.empty() ? "" : " ") + verb->get_name();
  }
  if (verb->get_option_no_throw(option) != nullptr) return;
  throw doppel::InputError("cli.use", {}, fmt::format("'{}' does not work on a ROS 2 graph", path),
                           fmt::format("omit {}", option));
}

// An engine's state is one block of many megabytes, most of which is never touched. glibc moves its threshold
// up when such a block is freed; later ones then come from the heap, on pages that are in use, and hundreds
// of edits leave it in pieces. A fixed threshold keeps these blocks apart from the heap.
void keep_large_blocks_apart() {
  constexpr int kLargeBlock = 1 << 20, kSpareTop = 1 << 22;
  mallopt(M_MMAP_THRESHOLD, kLargeBlock);
  mallopt(M_TRIM_THRESHOLD, kSpareTop);
}

// For every verb; those that join a network print the note about a distribution that is not known here.
void set_distro_of_environment() {
  doppel::Diagnostics unprinted;
  if (const auto distro = doppel::ros2::distro_from_environment(std::getenv, unprinted))
    doppel::set_ros_distro(*distro);
}

// The other verbs are a plugin module: up and view neither wait for its build in a new checkout nor load it.
void add_other_verbs(CLI::App& app, const doppel::RosArguments& ros, int& exit_code) {
  using AddVerbs = void(CLI::App&, const doppel::RosArguments&, int&);
  void* const add_verbs = doppel::plugin_symbol("doppel_verbs", "doppel_add_verbs");
  reinterpret_cast<AddVerbs*>(add_verbs)(app, ros, exit_code);
}

int run(const std::vector<std::string>& arguments) {
  CLI::App app("doppel turns a robot description into a digital twin.", "doppel");
  app.set_version_flag("-v,--version", "doppel " + std::string(doppel::version()));
  app.require_subcommand(1);
  bool remote = false;
  app.add_flag("--remote", remote,
               "Connect to the ROS 2 graph of ROS_DOMAIN_ID instead of a twin: topic, node, ...");
  std::string name_space;
  app.add_option("--ns", name_space, "Use the robot in this namespace: topic, control, move, ...");
  app.parse_complete_callback([&] {
    if (remote) refuse_elsewhere(app, "--remote");
    if (!name_space.empty()) refuse_elsewhere(app, "--ns");
  });
  int exit_code = 0;
  doppel::RosArguments ros;  // of up, view and teleop
  doppel::app::add_up(app, ros, exit_code);
  doppel::app::add_view(app, ros, exit_code);
  doppel::app::add_launch(app, exit_code);
  if (arguments.empty() ||
      (arguments.front() != "up" && arguments.front() != "view" && arguments.front() != "launch"))
    add_other_verbs(app, ros, exit_code);
  // Last: verbs inherit the footer that exists when they are added.
  app.footer(
      "Start here:\n  doppel up omarm_one\nor, to view a description without physics:\n  doppel view "
      "my_arm.urdf\nand from another shell:\n  doppel topic echo /joint_states\nor, for an arm of your "
      "own:\n  doppel new my_arm");
  if (arguments.empty()) {
    fmt::print("{}", doppel::app::short_help(app));
    return 0;
  }
  try {
    std::vector<std::string> words = arguments;
    ros = doppel::take_ros_arguments(words);
    const std::string verb = words.empty() ? "doppel" : words.front();
    if (!ros.empty() && verb != "up" && verb != "view" && verb != "teleop") refuse_ros_arguments(verb);
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ParseError& error) {
    return doppel::app::report_usage(app, error);
  } catch (const doppel::InputError& error) {
    doppel::app::print_stderr("{}\n{}", error.what(), doppel::app::help_line(error));
    return doppel::app::exit_code_of(error);
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  keep_large_blocks_apart();
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a file beyond the limit of its size is then an error of write()
  doppel::app::fill_standard_files();
  doppel::ros2::forget_statistics();
  set_distro_of_environment();
  const std::vector<std::string> words(argv + 1, argv + argc);
  doppel::allow_pipes(words);
  const int exit_code =
      doppel::app::with_output_written(doppel::app::with_failures_reported([&] { return run(words); }));
  if (doppel::has_abandoned_thread()) {
    std::fflush(nullptr);
    std::_Exit(exit_code);
  }
  return exit_code;
}
