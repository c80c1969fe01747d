#include "app/view.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>
#include <thread>

#include "app/described_scenario.h"
#include "app/door.h"
#include "app/judgement.h"
#include "app/process.h"
#include "app/ros_door.h"
#include "app/tell.h"
#include "app/terminal_log.h"
#include "app/verbs/description_target.h"
#include "doppel/bus/rosout.h"
#include "doppel/session/health_publisher.h"
#include "doppel/session/offered_files.h"
#include "doppel/session/reload.h"
#include "doppel/twin/viewer.h"

namespace doppel::app {
namespace {

constexpr std::chrono::microseconds kFrame{16'667};

struct ViewOptions {
  DescribedBy robot;
  bool no_reload = false, headless = false;
  DoorOptions door;
  RosDoorOptions ros_door;
};

void print_banner(const Viewer& viewer, const Door& door, const RosDoor& ros_door) {
  const Model& model = viewer.model();
  tell("{}: {} links, {} joints ({} to move), no physics\n", model.name, model.links.size(),
       model.joints.size(), model.driven_joint_names().size());
  tell("  joints       /joint_command (sensor_msgs/msg/JointState) sets them\n");
  door.print();
  ros_door.print();
  tell("  ready        {:.0f} ms after the start\n", milliseconds_since_process_start());
}

// Until `stop`; frames that could not be kept up with are left out.
void show_frames(Viewer& viewer, const std::atomic<bool>& stop) {
  auto due = std::chrono::steady_clock::now();
  while (!stop) {
    viewer.step(std::chrono::system_clock::now().time_since_epoch());
    due = std::max(due + kFrame, std::chrono::steady_clock::now());
    std::this_thread::sleep_until(due);
  }
}

int run_view(const ViewOptions& options, const RosArguments& ros) {
  Scenario scenario = described_scenario(options.robot);
  scenario.ros = ros;
  const auto network = ros_network(options.ros_door, ros);
  const std::atomic<bool>& stop = stop_on_signals();
  TerminalLog terminal;
  Log log;
  log.add_sink(terminal.sink(ros.log_level));
  Diagnostics diagnostics;
  Viewer viewer(scenario, log, diagnostics);
  const Rosout rosout(viewer.bus());
  log.add_sink(rosout.sink());
  tell_unused(ros, viewer.bus(), diagnostics);
  print_diagnostics(diagnostics, true);

  const auto assets = std::make_shared<AssetLibrary>();
  Door door(viewer.bus(), viewer.model().name, options.door, assets, log);
  RosDoor ros_door(viewer.bus(), network, log);
  HealthPublisher health(viewer.bus(), "", [robot = scenario.robots.front()] { return health_json(robot); });
  const auto look = [&] {
    assets->offer(files_of(viewer.description()));
    health.look_at(viewer.description());
  };
  look();
  const auto offer_both = [&](const Viewer::Replacement& next) {
    assets->offer(both(files_of(Viewer::description(next)), files_of(viewer.description())));
  };
  std::unique_ptr<Reloader> reloader;
  if (!options.no_reload) reloader = std::make_unique<Reloader>(reloadable(viewer, offer_both, look), log);
  print_banner(viewer, door, ros_door);
  ros_door.open();
  if (!options.headless) door.open_page();
  show_frames(viewer, stop);
  return 0;
}

}  // namespace

void add_view(CLI::App& app, const RosArguments& ros, int& exit_code) {
  auto options = std::make_shared<ViewOptions>();
  CLI::App* view =
      app.add_subcommand("view", "Look at a description: the page and the joints, without physics");
  add_described_by(*view, options->robot);
  view->add_flag("--no-reload", options->no_reload, "Do not pick up edits of the sources while it runs");
  view->add_flag("--headless", options->headless, "Open no page, as --no-open; there is no live table here");
  add_door_options(*view, options->door);
  add_ros_door_options(*view, options->ros_door);
  view->footer(
      "Whatever can be drawn is drawn; faults are warnings, and the page's Health tells them with their "
      "places.\n"
      "Examples:\n"
      "  doppel view omarm_one\n"
      "  doppel view my_arm.urdf.xacro use_gripper:=true\n"
      "  doppel view ~/ros2_ws --port 8800\n"
      "and from another shell:\n"
      "  doppel topic pub --once /joint_command sensor_msgs/msg/JointState '{name: [elbow], position: "
      "[0.5]}'");
  view->callback([options, &ros, &exit_code] { exit_code = run_view(*options, ros); });
}

}  // namespace doppel::app
