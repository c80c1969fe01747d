#include "app/up.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cctype>
#include <cmath>
#include <condition_variable>
#include <future>
#include <mutex>
#include <set>
#include <thread>

#include "app/browser.h"
#include "app/described_scenario.h"
#include "app/description_target.h"
#include "app/edge_options.h"
#include "app/hardware_options.h"
#include "app/live_table.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/process.h"
#include "app/run_scenario.h"
#include "app/snapshot.h"
#include "app/terminal_log.h"
#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/installation.h"
#include "doppel/base/core/plugin_module.h"
#include "doppel/base/core/text.h"
#include "doppel/ros/bus/rosout.h"
#include "doppel/scenario/resolve/open_target.h"
#include "doppel/scenario/schema/robot_text.h"
#include "doppel/session/live/session.h"
#include "doppel/session/validation/live_validation.h"
#include "doppel/twin/assembly/runner.h"
#include "doppel/twin/assembly/twin.h"
#include "doppel/version.h"

namespace doppel::app {
namespace {

constexpr std::size_t kPairsShown = 8;
constexpr std::size_t kMinGroup = 3;  // sensors of one kind that are listed as one line

struct UpOptions {
  DescribedBy robot;
  std::string record, write_scenario, world, controllers, base = "auto", speed = "1", stamp = "sim",
                                                          engine = kDefaultEngine;
  std::vector<std::string> robots, activate, plugins;
  double duration = 0, black_box = 30;
  std::uint64_t seed = 0;
  std::string sensors = "beside", cameras;
  int sensor_threads = 1;
  bool no_reload = false, no_rewind = false;
  bool strict = false;
  bool verbose = false;
  bool headless = false, json = false, no_controllers = false, ideal = false, no_limits = false;
  HardwareRunOptions hardware;
  EdgeOptions edges;
};

Scenario make_scenario(const UpOptions& options, const RosArguments& ros) {
  Scenario scenario = described_scenario(options.robot);
  scenario.ros = ros;
  scenario.wall_stamps = options.stamp == "wall";
  if (!options.world.empty()) scenario.world = options.world;
  scenario.engine = options.engine;
  for (const std::string& text : options.robots) scenario.robots.push_back(parse_robot(text));
  for (WorldRobot& robot : scenario.robots) {
    if (!options.controllers.empty()) robot.controllers = options.controllers;
    robot.activate = options.activate;
    if (options.base != "auto")
      robot.base = options.base == "floating" ? BaseKind::floating : BaseKind::fixed;
  }
  scenario.start_controllers = !options.no_controllers;
  apply(options.hardware, options.seed, scenario);
  scenario.plugins = options.plugins;
  scenario.ideal = options.ideal;
  scenario.enforce_limits = !options.no_limits;
  scenario.strict = options.strict;
  scenario.sensors = {
      .seed = options.seed, .lockstep = options.sensors == "lockstep", .threads = options.sensor_threads};
  return scenario;
}

double parse_speed(const std::string& text) {
  if (text == "max") return 0.0;
  const std::optional<double> speed = parse_number(text);
  if (!speed || *speed < kMinSpeed || *speed > kMaxSpeed) {
    throw InputError("cli.speed", {},
                     fmt::format("--speed is '{}'; it must be a number from {:g} to {:g}, or max", text,
                                 kMinSpeed, kMaxSpeed),
                     "1 is real time, 0.5 half of it, max as fast as possible");
  }
  return *speed;
}

// Draws the live table from a thread of its own; the state is taken on the loop's thread, between steps.
class TableThread {
 public:
  TableThread(Twin& twin, const Runner& runner, TerminalLog& log, std::string title)
      : twin_(twin), runner_(runner), log_(log), title_(std::move(title)) {
    thread_ = guarded_thread(
        [this] { run(); },
        [this](const std::string& what) {
          log_.add({Severity::error, "terminal", fmt::format("the live table is off: {}", what)});
        });
  }

  ~TableThread() {
    {
      const std::lock_guard lock(mutex_);
      done_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }

 private:
  void run() {
    LiveTable table(STDOUT_FILENO);
    std::unique_lock lock(mutex_);
    while (!done_) {
      lock.unlock();
      const auto promise = std::make_shared<std::promise<Snapshot>>();
      auto future = promise->get_future();
      twin_.bus().post([promise, &twin = twin_] { promise->set_value(take_snapshot(twin)); });
      if (future.wait_for(std::chrono::milliseconds(500)) == std::future_status::ready) {
        const RunnerView& view = runner_.view();
        table.draw({title_, future.get(), view.real_time_factor.load(), view.paused.load(), log_.recent()});
      }
      lock.lock();
      wake_.wait_for(lock, std::chrono::milliseconds(100), [this] { return done_; });
    }
  }

  Twin& twin_;
  const Runner& runner_;
  TerminalLog& log_;
  std::string title_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool done_ = false;
  std::thread thread_;
};

std::string controllers_text(const std::vector<ControllerView>& controllers) {
  std::string out;
  for (const ControllerView& controller : controllers) {
    out += fmt::format("{}{} ({})", out.empty() ? "" : ", ", controller.name,
                       doppel::to_string(controller.state));
  }
  return out;
}

// Joints that a controller can command.
std::size_t driven_joints(const TwinRobot& robot) {
  std::set<std::string> joints;
  for (const InterfaceView& command : robot.controller_manager().command_interfaces()) {
    const std::string joint = command.full_name.substr(0, command.full_name.find_last_of('/'));
    if (robot.model().find_joint(joint) >= 0) joints.insert(joint);
  }
  return joints.size();
}

// Loads beyond an effort limit, and with `verbose` every load that a drive yields to.
void print_gravity(const TwinRobot& robot, bool verbose) {
  bool heading = false;
  for (const SagReport& sag : robot.gravity_sag()) {
    if (sag.margin >= 0 && (!verbose || std::abs(sag.sag) < 5e-4)) continue;
    print_stderr(
        "  {:<12} {}: {:+.3f} N m of load, sag {:+.4f} rad{}{}\n", heading ? "" : "gravity", sag.joint,
        sag.torque, sag.sag,
        sag.most > sag.least ? fmt::format(", with friction {:+.4f} to {:+.4f}", sag.least, sag.most) : "",
        sag.margin < 0 ? "; the load exceeds its effort limit" : "");
    heading = true;
  }
}

void print_robot(TwinRobot& robot) {
  const Model& model = robot.model();
  const RobotDescription& description =
      robot.description();  // without the joint of a floating base to the world
  const std::string mass = model.total_mass < 1 ? fmt::format("{:.1f} g", model.total_mass * 1e3)
                                                : fmt::format("{:.4g} kg", model.total_mass);
  const auto counted = [](std::size_t count, const char* noun) {
    return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
  };
  print_stderr("{}{}: {}, {} ({} driven), {}\n", model.name,
               robot.name_space().empty() ? "" : fmt::format(" in /{}", robot.name_space()),
               counted(description.links.size(), "link"), counted(description.joints.size(), "joint"),
               driven_joints(robot), mass);
}

void print_controllers(TwinRobot& robot) {
  const std::string text = controllers_text(robot.controller_manager().controllers());
  if (text.empty()) return print_stderr("  controllers  none: the joints are passive\n");
  print_stderr("  controllers  {}\n               {}\n", text,
               robot.controllers_origin() == "generated"
                   ? "generated by doppel, because the description has none"
                   : "from " + robot.controllers_origin());
}

std::string without_digits(const std::string& text) {
  std::string out = text;
  std::erase_if(out, [](unsigned char c) { return std::isdigit(c) != 0; });
  return out;
}

// Sensors that differ by a number only, such as a ring of sonars.
bool same_group(const doppel_msgs::msg::Sensor& a, const doppel_msgs::msg::Sensor& b) {
  return a.type == b.type && a.rate == b.rate && without_digits(a.name) == without_digits(b.name) &&
         without_digits(a.topics.front()) == without_digits(b.topics.front());
}

void print_sensors(const Twin& twin) {
  const std::vector<RigStatus> sensors = twin.sensors();
  for (std::size_t i = 0; i < sensors.size();) {
    std::size_t end = i + 1;
    while (end < sensors.size() && same_group(sensors[i].sensor, sensors[end].sensor)) ++end;
    if (end - i < kMinGroup) end = i + 1;
    const doppel_msgs::msg::Sensor &first = sensors[i].sensor, &last = sensors[end - 1].sensor;
    const bool many = end - i > 1;
    print_stderr("  {:<12} {}{} ({}, {}) on {}{}\n", i > 0 ? "" : "sensors",
                 many ? fmt::format("{} from {} to ", end - i, first.name) : "", last.name, first.type,
                 first.rate > 0 ? fmt::format("{:.4g} Hz", first.rate) : "every step",
                 many ? first.topics.front() + " to " : "", last.topics.front());
    i = end;
  }
}

void print_contacts(const CompiledWorld& world) {
  const std::vector<ExcludedPair>& excluded = world.excluded_pairs();
  std::vector<std::string> touching;
  for (const ExcludedPair& pair : excluded) {
    if (pair.at_start) touching.push_back(world.name_of(pair.a) + " + " + world.name_of(pair.b));
  }
  print_stderr("  contact      ground and links; {} pairs of neighbours excluded\n",
               excluded.size() - touching.size());
  if (touching.empty()) return;
  const std::size_t shown = std::min(touching.size(), kPairsShown);
  print_stderr("               and what touches at the start: {}{}\n",
               fmt::join(touching.begin(), touching.begin() + static_cast<std::ptrdiff_t>(shown), ", "),
               touching.size() > shown ? fmt::format(" and {} more", touching.size() - shown) : "");
}

void print_physics(Twin& twin, const std::string& engine) {
  print_stderr("  physics      {}, {:g} Hz; {}\n", engine, 1.0 / to_seconds(twin.step_size()),
               twin.bus().sim_time() ? "messages are stamped with simulated time (/clock)"
                                     : "messages are stamped with wall-clock time; there is no /clock");
}

void print_twin_banner(Twin& twin, const std::string& engine, bool verbose) {
  if (twin.robots().size() == 1) {
    print_robot(twin.robot());
    print_physics(twin, engine);
    print_controllers(twin.robot());
    print_contacts(twin.engine().world());
    print_sensors(twin);
    return print_gravity(twin.robot(), verbose);
  }
  for (const auto& robot : twin.robots()) {
    print_robot(*robot);
    print_controllers(*robot);
    print_gravity(*robot, verbose);
  }
  print_stderr("{}\n", twin.robots().empty() ? "a world without robots" : "in one world");
  print_physics(twin, engine);
  print_contacts(twin.engine().world());
  print_sensors(twin);
}

// Notes about a robot that comes with doppel, such as the choice of its base, are printed on request
// only.
bool is_note_about_bundled_robot(const Diagnostic& diagnostic) {
  static const std::string kFolder = (data_folder() / "robots").string() + "/";
  return diagnostic.severity == Severity::note && diagnostic.where.known() &&
         diagnostic.where.file->starts_with(kFolder);
}

void print_start_diagnostics(const Diagnostics& diagnostics, bool verbose) {
  Diagnostics shown;
  for (const Diagnostic& diagnostic : diagnostics.all()) {
    if (verbose || !is_note_about_bundled_robot(diagnostic)) shown.add(diagnostic);
  }
  print_diagnostics(shown, true, verbose ? kAllOfRule : kFewOfRule);
}

// Reports the end of the run; returns the exit code.
int report_end(Twin& twin, Summary summary, bool json) {
  summary.state_hash = twin.state_hash();
  {
    const auto held = twin.hold();
    summary.last = take_snapshot(twin);
  }
  for (const auto& robot : twin.robots()) {
    robot->conclude_rest();
    Summary::Robot& of = summary.robots.emplace_back();
    of.name = robot->name();
    of.rest = robot->rest();
    of.rest_reason = robot->rest_reason();
    of.state_hash = robot->state_hash();
    if (robot->machine().instance().floating())
      of.X_WB = robot->instance().link_pose(robot->machine().instance().base_link());
    for (OscillationReport found : robot->oscillations()) {
      if (twin.robots().size() > 1) found.joint = robot->name() + "::" + found.joint;
      summary.oscillations.push_back(std::move(found));
    }
  }
  for (const RigStatus& status : twin.sensors())
    summary.sensors.push_back(
        {status.sensor.name, status.sensor.samples, status.sensor.left_out, status.hash});
  if (json) fmt::print("{}\n", to_json(summary));
  if (summary.run.end == RunEnd::diverged) {
    print_stderr(
        "error: the physics diverged at t = {:.3f} s: a position, velocity or acceleration is not finite\n  "
        "fix: look for small masses on strong joints, or set a smaller step in a world file (--world)\n",
        to_seconds(twin.now()));
    return 1;
  }
  if (!json) {
    print_stderr("{}: {:.2f} s simulated in {:.2f} s, {:.2f} x real time\n", summary.robot,
                 to_seconds(summary.run.simulated), static_cast<double>(summary.run.wall.count()) * 1e-9,
                 summary.run.real_time_factor());
  }
  return 0;
}

// A folder that exists is one for bags.
RunRecordingOptions recording_of(const UpOptions& options) {
  if (std::filesystem::exists(std::filesystem::path(options.record) / kBagMetadataFile)) {
    throw InputError("output.unwritable", {},
                     fmt::format("'{}' is a bag, which is never appended to", options.record),
                     "name another folder");
  }
  RunRecordingOptions out;
  out.version = version();
  out.bag.folder = std::filesystem::is_directory(options.record) ? dated_bag_folder(options.record)
                                                                 : std::filesystem::path(options.record);
  return out;
}

BlackBoxOptions black_box_of(const UpOptions& options) {
  BlackBoxOptions out = default_black_box();
  out.length = from_seconds(options.black_box);
  out.version = version();
  return out;
}

// Prints what was recorded; false: not everything.
bool report_recording(BusRecorder* recorder) {
  if (recorder == nullptr) return true;
  const RecorderReport& report = recorder->stop();
  print_stderr("recorded {} messages, {:.1f} MB: {}\n", report.messages,
               static_cast<double>(report.bytes) * 1e-6, recorder->folder().string());
  return report.failure.empty() && report.lost.empty();
}

// The suite is in the part of the program that has the other verbs, which is loaded with the first request.
std::shared_ptr<ValidationWork> load_validation() {
  using MakeValidation = void(const LiveValidationOptions&, std::shared_ptr<ValidationWork>&);
  void* const make = plugin_symbol("doppel_verbs", "doppel_make_validation");
  std::shared_ptr<ValidationWork> out;
  // The loop and its clients keep half of the processors.
  const std::size_t jobs = std::max(1U, std::thread::hardware_concurrency() / 2);
  reinterpret_cast<MakeValidation*>(make)({bundled_folders(), std::string(version()), jobs}, out);
  return out;
}

RunnerOptions runner_options(const UpOptions& options, double speed, BusRecorder* recorder, const Log& log) {
  RunnerOptions out;
  out.speed = speed;
  out.report_stall = [&log](const std::string& what) { log.error("loop", what); };
  out.ends_at_divergence = options.json || options.duration > 0;
  if (options.duration > 0) out.duration = from_seconds(options.duration);
  // The run is as fast as the disk at most, so that the recording is complete.
  if (speed == 0 && recorder != nullptr) out.before_step = [recorder] { recorder->let_catch_up(); };
  return out;
}

// With the table in the terminal or without.
RunStatistics run_twin(Runner& runner, Twin& twin, TerminalLog& terminal, const Summary& summary, bool table,
                       const std::atomic<bool>& stop) {
  if (!table) return runner.run(stop);
  terminal.table_begins();
  const TableThread drawing(twin, runner, terminal, twin.name() + "  " + summary.engine);
  return runner.run(stop);
}

int run_up(const UpOptions& options, const CLI::App& verb, const RosArguments& given_ros) {
  const double speed = parse_speed(options.speed);
  if (options.duration < 0 || !std::isfinite(options.duration)) {
    throw InputError("cli.duration", {}, "--duration must be a positive number of simulated seconds");
  }
  if (!options.write_scenario.empty()) check_output(options.write_scenario);
  Diagnostics diagnostics;
  const std::optional<Scenario> written = given_scenario(options.robot.words, verb, given_ros, diagnostics);
  const Scenario scenario = written ? *written : make_scenario(options, given_ros);
  const RosArguments& ros = scenario.ros;
  SessionOptions session_with = session_options(options.edges, ros);
  session_with.reload = !options.no_reload;
  session_with.rewind = !options.no_rewind;
  if (!options.record.empty()) session_with.record = recording_of(options);
  if (options.black_box > 0) session_with.black_box = black_box_of(options);
  if (!options.cameras.empty()) session_with.cameras = camera_feed_options(options.cameras);
  session_with.validation = load_validation;
  session_with.scenario = scenario;
  const bool table = !options.headless && !options.json && isatty(STDOUT_FILENO) != 0;

  const std::atomic<bool>& stop_requested = stop_on_signals();
  TerminalLog terminal;
  Log log;
  log.add_sink(terminal.sink(ros.log_level));
  Twin twin(scenario, log, diagnostics);
  const Rosout rosout(twin.bus());
  log.add_sink(rosout.sink());
  report_unused(ros, twin.bus(), diagnostics);
  for (const auto& robot : twin.robots()) report_misspellings(robot->machine(), diagnostics);
  print_start_diagnostics(diagnostics, options.verbose);
  if (!options.write_scenario.empty()) {
    write_scenario(twin, options.write_scenario);
    return 0;
  }

  TwinSession session(twin, session_with, log);
  Browser browser(log);
  Summary summary;
  summary.robot = twin.name();
  summary.engine = twin.engine().world().capabilities().name;
  print_twin_banner(twin, summary.engine, options.verbose);
  if (written) print_stderr("  scenario     {}\n", content_hash_text(twin, options.robot.words.front()));
  print_stderr("{}", session.banner());
  if (!options.headless && !options.json && !options.edges.no_open)
    browser.open(session.server().server().page_url());

  Runner runner(twin, runner_options(options, speed, session.recorder(), log));
  runner.on_first_step([&] {
    summary.startup_ms = milliseconds_since_process_start();
    print_stderr("  ready        {:.0f} ms after the start\n", summary.startup_ms);
    print_stderr("{}", session.page_line());
    session.begin();
  });
  summary.run = run_twin(runner, twin, terminal, summary, table, stop_requested);
  session.end();
  terminal.table_ends();
  const bool complete = report_recording(session.recorder());
  const int exit_code = report_end(twin, std::move(summary), options.json);
  return complete ? exit_code : std::max(exit_code, 1);
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
    "For any program that speaks to the servos' bus: the makers' SDKs, LeRobot, another driver.";

void add_session_flags(CLI::App& up, UpOptions& options) {
  up.add_option("--zmq-cameras", options.cameras,
                "Publish the pictures of the cameras by ZeroMQ, as JPEG in JSON, on this port, for LeRobot's "
                "cameras of type zmq; 0.0.0.0:PORT for other machines")
      ->type_name("PORT");
  constexpr double kMaxBlackBox = 30;
  up.add_option(
        "--black-box", options.black_box,
        "Seconds that are kept all the time, and written when something happens (default 30; 0: none)")
      ->check(CLI::Range(0.0, kMaxBlackBox));
  up.add_flag("--no-reload", options.no_reload, "Do not reload when the sources change");
  up.add_flag("--no-rewind", options.no_rewind, "Keep no automatic states for 'doppel rewind'");
  up.add_flag("-v,--verbose", options.verbose,
              "Print the load and sag of each drive, and the notes about a bundled robot");
  up.add_flag("--headless", options.headless, "Log lines only: no live table, no browser");
  up.add_flag("--json", options.json, "Print a JSON summary to stdout at the end");
}

void add_time_options(CLI::App& up, UpOptions& options) {
  up.add_option("--duration", options.duration, "Stop after this many simulated seconds");
  up.add_option("--speed", options.speed, "1: real time, N: N times real time, max: as fast as possible");
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
  up->add_option("--plugin", options->plugins,
                 "Shared library with your own controllers or hardware components")
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
  add_write_scenario(*up, options->write_scenario);
  up->add_option(
        "--record", options->record,
        "Record everything from the first step on as a bag (MCAP) that can be run again; a folder that "
        "exists gets a bag named by the time")
      ->type_name("FOLDER");
  add_session_flags(*up, *options);
  add_edge_options(*up, options->edges);
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
