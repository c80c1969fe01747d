#include "app/up.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "app/described_scenario.h"
#include "app/hardware_options.h"
#include "app/run_scenario.h"
#include "app/run_twin.h"
#include "doppel/scenario/schema/robot_text.h"

namespace doppel::app {
namespace {

struct UpOptions {
  DescribedBy robot;
  std::string world, controllers, base = "auto", stamp = "sim", engine = kDefaultEngine;
  std::vector<std::string> robots, activate, plugins;
  std::uint64_t seed = 0;
  std::string sensors = "beside";
  int sensor_threads = 1;
  bool strict = false;
  bool no_controllers = false, ideal = false, no_limits = false;
  HardwareRunOptions hardware;
  RunOptions run;
};

Scenario make_scenario(const UpOptions& options, const RosArguments& ros) {
  Scenario scenario = described_scenario(options.robot);
  scenario.ros = ros;
  scenario.wall_stamps = options.stamp == "wall";
  if (!options.world.empty()) scenario.world = options.world;
  scenario.engine = options.engine;
  for (const std::string& text : options.robots) scenario.robots.push_back(parse_robot(text));
  for (WorldRobot& robot : scenario.robots) {
    if (!options.controllers.empty()) robot.controllers = {options.controllers};
    robot.activate = options.activate;
    if (options.base != "auto")
      robot.base = options.base == "floating" ? BaseKind::floating : BaseKind::fixed;
  }
  // An emulated arm is moved by the driver at its port, or by the hand.
  const bool has_own_controllers = !options.hardware.ports || options.hardware.hand == "guide";
  scenario.start_controllers = !options.no_controllers && has_own_controllers;
  apply(options.hardware, options.seed, scenario);
  scenario.plugins = options.plugins;
  scenario.ideal = options.ideal;
  scenario.enforce_limits = !options.no_limits;
  scenario.strict = options.strict;
  scenario.sensors = {
      .seed = options.seed, .lockstep = options.sensors == "lockstep", .threads = options.sensor_threads};
  return scenario;
}

int run_up(const UpOptions& options, const CLI::App& verb, const RosArguments& given_ros) {
  check_run_options(options.run);
  Diagnostics diagnostics;
  std::optional<Scenario> written =
      given_scenario(options.robot.words, verb, given_ros, options.plugins, diagnostics);
  RunHooks hooks;
  if (written) {
    written->emulation.trace = options.hardware.trace;
    hooks.banner = [&file = options.robot.words.front()](Twin& twin) {
      return fmt::format("  scenario     {}\n", content_hash_text(twin, file));
    };
  }
  return run_twin(written ? *written : make_scenario(options, given_ros), options.run, diagnostics, hooks);
}

constexpr const char* kUpExamples =
    "Examples:\n"
    "  doppel up omarm_one\n"
    "  doppel up my_arm.urdf.xacro use_gripper:=true --speed 2\n"
    "  doppel up --robot omarm_one:left --robot omarm_one:right@0.8,0,0,0,0,3.14159 --world "
    "worlds/table.yaml\n"
    "  doppel up omarm_one --world my_world.sdf\n"
    "  doppel up --world my_world.sdf          # without a robot\n"
    "  doppel up ~/ros2_ws --controllers ~/ros2_ws/src/my_arm/config/controllers.yaml\n"
    "  doppel up omarm_one --ros-args -r __ns:=/left -r /clock:=clock -p robot_state_publisher:"
    "frame_prefix:=left/\n"
    "  doppel up omarm_one --host 0.0.0.0      # for a tablet beside the robot: open the printed address\n"
    "  doppel up omarm_one --world table --write-scenario run.yaml   # what would run, with nothing left to "
    "guess\n"
    "  doppel up run.yaml\n"
    "  doppel up omarm_zero --headless --duration 10 --speed max --json\n"
    "  doppel up omarm_one --record my_run     # then: doppel bag info my_run, doppel bag resimulate my_run";

constexpr const char* kEmulateExamples =
    "Examples:\n"
    "  doppel emulate my_arm                  # prints the port, for instance /dev/pts/7\n"
    "  doppel hardware scan --port /dev/pts/7\n"
    "  doppel up my_arm use_sim:=false        # with this port in hardware.yaml\n"
    "  doppel emulate ur5e --protocol feetech # a bus for a robot whose description has none\n"
    "It stays off the ROS 2 network, where its driver has the arm's names, unless --domain is given.\n"
    "For any program that speaks to the servos' bus: the makers' SDKs, LeRobot, another driver.";

void add_time_options(CLI::App& up, UpOptions& options) {
  up.add_option("--stamp", options.stamp,
                "Time in message headers: sim (simulated time, published on /clock) or wall (for clients "
                "that do not set use_sim_time)")
      ->check(CLI::IsMember({"sim", "wall"}));
  up.add_option("--seed", options.seed,
                "Seed of the noise of sensors (default 0); the same seed gives the same data");
  up.add_option("--sensors", options.sensors,
                "beside: cameras and lidars never delay the loop, samples that take too long are dropped; "
                "lockstep: the "
                "loop waits for each sample, as for recordings with --speed max")
      ->check(CLI::IsMember({"beside", "lockstep"}));
  up.add_option("--sensor-threads", options.sensor_threads,
                "Threads among which cameras and lidars are divided (default 1); the data are the same")
      ->check(CLI::Range(1, 64));
}

// Adds `up` or `emulate`.
void add_run(CLI::App& app, const char* name, const char* help, const std::shared_ptr<UpOptions>& options,
             const char* examples, const RosArguments& ros, int& exit_code) {
  CLI::App* up = app.add_subcommand(name, help);
  add_described_by(*up, options->robot, false);
  up->add_option("--robot", options->robots,
                 "A robot as TARGET[:NAMESPACE][@x,y,z[,roll,pitch,yaw]], m and rad; repeatable, each in its "
                 "own namespace")
      ->take_all();
  up->add_option("--controllers", options->controllers,
                 "Controllers' parameter file (YAML) to use instead of the description's");
  up->add_option("--activate", options->activate, "Activate only these controllers; the others stay inactive")
      ->delimiter(',');
  up->add_flag("--no-controllers", options->no_controllers, "Load no controllers: the joints are passive");
  up->add_option(
        "--plugin", options->plugins,
        "Shared library with your own controllers or hardware components; beside a scenario file: one "
        "that it needs and that you trust")
      ->take_all();
  up->add_option("--world", options->world,
                 "World: a YAML or SDF file (.sdf, .world), a model's folder, a bundled world ('doppel "
                 "worlds'), or a name on "
                 "GZ_SIM_RESOURCE_PATH");
  up->add_option("--engine", options->engine, "Physics engine; 'doppel engines' lists the available ones")
      ->capture_default_str();
  up->add_option("--base", options->base,
                 "Base of a robot without a link 'world': fixed, floating (placed on the ground), or auto: "
                 "floating if the description suggests wheels or legs")
      ->check(CLI::IsMember({"auto", "fixed", "floating"}));
  add_hardware_options(*up, options->hardware);
  up->add_flag("--ideal", options->ideal, "Ideal servos: joints follow commands exactly, whatever the load");
  up->add_flag("--no-limits", options->no_limits, "Do not enforce joint limits on commands");
  up->add_flag(
      "--strict", options->strict,
      "Refuse what ROS 2 would drop: a Twist on a topic where TwistStamped is read, and the reverse");
  add_time_options(*up, *options);
  add_run_options(*up, options->run);
  up->footer(examples);
  up->callback([options, up, &ros, &exit_code] { exit_code = run_up(*options, *up, ros); });
}

}  // namespace

void add_up(CLI::App& app, const RosArguments& ros, int& exit_code) {
  const auto options = std::make_shared<UpOptions>();
  add_run(app, "up", "Start a robot: physics, controllers, topics", options, kUpExamples, ros, exit_code);
  const auto emulated = std::make_shared<UpOptions>();
  emulated->hardware.ports = true;
  add_run(app, "emulate", "An arm that is not there: its servos behind a pseudo-terminal, for any driver",
          emulated, kEmulateExamples, ros, exit_code);
}

}  // namespace doppel::app
