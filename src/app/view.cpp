#include "app/view.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <thread>

#include "app/browser.h"
#include "app/described_scenario.h"
#include "app/description_target.h"
#include "app/edge_options.h"
#include "app/number_checks.h"
#include "app/print_stderr.h"
#include "app/process.h"
#include "app/terminal_log.h"
#include "app/view_recording.h"
#include "doppel/ros/bus/rosout.h"
#include "doppel/session/live/recording_view.h"
#include "doppel/session/live/session.h"
#include "doppel/twin/viewer/viewer.h"

namespace doppel::app {
namespace {

constexpr std::chrono::microseconds kFrame{16'667};

struct ViewOptions {
  DescribedBy robot;
  ShowOptions show;
  std::optional<double> time;  // of a recording
};

void print_viewer_banner(const Viewer& viewer, const Session& session) {
  const Model& model = viewer.model();
  print_stderr("{}: {} links, {} joints ({} movable), no physics\n", model.name, model.links.size(),
               model.joints.size(), model.driven_joint_names().size());
  print_stderr("  joints       /joint_command (sensor_msgs/msg/JointState) sets them\n");
  print_stderr("{}", session.banner());
  print_stderr("  ready        {:.0f} ms after the start\n", milliseconds_since_process_start());
  print_stderr("{}", session.page_line());
}

// Until `stop`; late frames are skipped.
void show_frames(Viewer& viewer, double duration, const std::atomic<bool>& stop) {
  auto due = std::chrono::steady_clock::now();
  const auto begin = due;
  const auto is_over = [&] {
    return duration > 0 && std::chrono::duration<double>(due - begin).count() >= duration;
  };
  while (!stop && !is_over()) {
    viewer.step(system_time());
    due = std::max(due + kFrame, std::chrono::steady_clock::now());
    std::this_thread::sleep_until(due);
  }
}

int run_recording(const ViewOptions& options, const RosArguments& ros) {
  if (!options.robot.set.empty())
    throw InputError("cli.use", {}, "--set is for descriptions, and a recording has no arguments", "omit it");
  return view_recording({.words = options.robot.words,
                         .time = options.time,
                         .opens_browser = !options.show.headless && !options.show.edges.no_open,
                         .edges = options.show.edges},
                        ros);
}

int run_view(const ViewOptions& options, const RosArguments& ros) {
  if (is_recording(options.robot.words.front())) return run_recording(options, ros);
  if (options.time)
    throw InputError(
        "cli.use", {},
        fmt::format("--at is a time of a recording, and '{}' is none", options.robot.words.front()),
        "name an .mcap file or the folder of a bag, or omit --at");
  Scenario scenario = described_scenario(options.robot);
  scenario.ros = ros;
  Diagnostics diagnostics;
  return show_robot(scenario, options.show, diagnostics, {});
}

}  // namespace

int show_robot(const Scenario& scenario, const ShowOptions& options, Diagnostics& diagnostics,
               const RunHooks& hooks) {
  const RosArguments& ros = scenario.ros;
  SessionOptions session_with = session_options(options.edges, ros);
  session_with.reload = !options.no_reload;
  const std::atomic<bool>& stop = stop_on_signals();
  const StderrWriter writer;
  TerminalLog terminal;
  Log log;
  log.add_sink(terminal.sink(ros.log_level));
  Viewer viewer(scenario, log, diagnostics);
  const Rosout rosout(viewer.bus());
  log.add_sink(rosout.sink());
  report_unused(ros, viewer.bus(), diagnostics);
  report_misspellings(viewer.expanded(), diagnostics);
  print_diagnostics(diagnostics, true, kFewOfRule);

  ViewSession session(viewer, scenario.robots.front(), session_with, log);
  print_viewer_banner(viewer, session);
  session.begin();
  Browser browser(log);
  if (!options.headless && !options.edges.no_open) browser.open(session.server().server().page_url());
  if (hooks.ready) hooks.ready({log, session.server().server().port()});
  show_frames(viewer, options.duration, stop);
  if (hooks.ended) hooks.ended();
  return 0;
}

void add_view(CLI::App& app, const RosArguments& ros, int& exit_code) {
  auto options = std::make_shared<ViewOptions>();
  CLI::App* view =
      app.add_subcommand("view", "View a description, or a recording, in the browser, without physics");
  add_described_by(*view, options->robot);
  view->get_option("TARGET")->description(
      view->get_option("TARGET")->get_description() +
      "; or a recording (an .mcap file, or the folder of a bag), and a second one to compare it with");
  view->add_option("--at", options->time, "Time of the recording to show first, s since its start")
      ->check(non_negative_number());
  view->add_flag("--no-reload", options->show.no_reload, "Do not reload when the sources change");
  view->add_flag("--headless", options->show.headless, "Do not open the web page (same as --no-open)");
  add_edge_options(*view, options->show.edges);
  view->footer(
      "Everything that can be drawn is drawn; faults are warnings, and the page's Health panel lists them "
      "with their location.\nOf a recording the page has a time line, curves, log and pictures; its messages "
      "are not published, which 'doppel bag play' does.\nExamples:\n  doppel view omarm_one\n  doppel view "
      "my_arm.urdf.xacro use_gripper:=true\n  doppel view ~/ros2_ws --port 8800\n  doppel view run.mcap "
      "--at 12.5\n  doppel view my_run second_run\nand from another shell:\n  doppel topic pub --once "
      "/joint_command sensor_msgs/msg/JointState '{name: [elbow], position: [0.5]}'");
  view->callback([options, &ros, &exit_code] { exit_code = run_view(*options, ros); });
}

}  // namespace doppel::app
