#include "app/run_twin.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <future>
#include <mutex>
#include <thread>

#include "app/browser.h"
#include "app/live_table.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/process.h"
#include "app/run_scenario.h"
#include "app/snapshot.h"
#include "app/terminal_log.h"
#include "app/twin_banner.h"
#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/plugin_module.h"
#include "doppel/base/core/text.h"
#include "doppel/ros/bus/rosout.h"
#include "doppel/session/live/session.h"
#include "doppel/session/validation/live_validation.h"
#include "doppel/twin/assembly/runner.h"
#include "doppel/version.h"

namespace doppel::app {
namespace {

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

// Reports the end of the run; returns the exit code.
int report_end(Twin& twin, Summary summary, bool json) {
  summary.state_hash = twin.state_hash();
  {
    const auto held = twin.hold();
    summary.last = take_snapshot(twin);
  }
  for (const auto& robot : twin.robots()) {
    robot->conclude_rest();
    Summary::Robot& entry = summary.robots.emplace_back();
    entry.name = robot->name();
    entry.rest = robot->rest();
    entry.rest_reason = robot->rest_reason();
    entry.state_hash = robot->state_hash();
    if (robot->machine().instance().floating())
      entry.X_WB = robot->instance().link_pose(robot->machine().instance().base_link());
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
RunRecordingOptions recording_of(const RunOptions& options) {
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

BlackBoxOptions black_box_of(const RunOptions& options) {
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

RunnerOptions runner_options(const RunOptions& options, double speed, BusRecorder* recorder, const Log& log) {
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
RunStatistics step_twin(Runner& runner, Twin& twin, TerminalLog& terminal, const Summary& summary, bool table,
                        const std::atomic<bool>& stop) {
  if (!table) return runner.run(stop);
  terminal.table_begins();
  const TableThread drawing(twin, runner, terminal, twin.name() + "  " + summary.engine);
  return runner.run(stop);
}

void add_session_flags(CLI::App& up, RunOptions& options) {
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

}  // namespace

void add_run_options(CLI::App& verb, RunOptions& options) {
  verb.add_option("--duration", options.duration, "Stop after this many simulated seconds");
  verb.add_option("--speed", options.speed, "1: real time, N: N times real time, max: as fast as possible");
  add_write_scenario(verb, options.write_scenario);
  verb.add_option(
          "--record", options.record,
          "Record everything from the first step on as a bag (MCAP) that can be run again; a folder that "
          "exists gets a bag named by the time")
      ->type_name("FOLDER");
  add_session_flags(verb, options);
  add_edge_options(verb, options.edges);
}

void check_run_options(const RunOptions& options) {
  parse_speed(options.speed);
  if (options.duration < 0 || !std::isfinite(options.duration))
    throw InputError("cli.duration", {}, "--duration must be a positive number of simulated seconds");
  if (options.edges.local_token && !options.cameras.empty()) {
    throw InputError(
        "cli.cameras", {},
        "--local-token closes the server to other users of this machine, and --zmq-cameras gives them the "
        "pictures: subscribers of ZeroMQ have no token",
        "leave --zmq-cameras out, and read the topics of the cameras with the token; or leave --local-token "
        "out");
  }
  if (!options.write_scenario.empty()) check_output(options.write_scenario);
}

int run_twin(const Scenario& scenario, const RunOptions& options, Diagnostics& diagnostics,
             const RunHooks& hooks) {
  const RosArguments& ros = scenario.ros;
  EdgeOptions edges = options.edges;
  // The names of an emulated arm are those of the arm, which its driver has.
  edges.server.emulated = scenario.hardware == HardwareUse::ports;
  edges.ros.none = edges.ros.none || (edges.server.emulated && !edges.ros.domain);
  SessionOptions session_with = session_options(edges, ros);
  session_with.reload = !options.no_reload;
  session_with.rewind = !options.no_rewind;
  if (!options.record.empty()) session_with.record = recording_of(options);
  if (options.black_box > 0) session_with.black_box = black_box_of(options);
  if (!options.cameras.empty()) session_with.cameras = camera_feed_options(options.cameras);
  session_with.validation = load_validation;
  session_with.scenario = scenario;
  const bool table = !options.headless && !options.json && isatty(STDOUT_FILENO) != 0;

  const std::atomic<bool>& stop_requested = stop_on_signals();
  const StderrWriter writer;
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
  if (hooks.banner) print_stderr("{}", hooks.banner(twin));
  print_stderr("{}", session.banner());
  if (!options.headless && !options.json && !options.edges.no_open)
    browser.open(session.server().server().page_url());

  Runner runner(twin, runner_options(options, parse_speed(options.speed), session.recorder(), log));
  runner.on_first_step([&] {
    summary.startup_ms = milliseconds_since_process_start();
    print_stderr("  ready        {:.0f} ms after the start\n", summary.startup_ms);
    print_stderr("{}", session.page_line());
    session.begin();
    if (hooks.ready) hooks.ready({log, session.server().server().port()});
  });
  summary.run = step_twin(runner, twin, terminal, summary, table, stop_requested);
  if (hooks.ended) hooks.ended();
  session.end();
  terminal.table_ends();
  const bool complete = report_recording(session.recorder());
  const int exit_code = report_end(twin, std::move(summary), options.json);
  return complete ? exit_code : std::max(exit_code, 1);
}

}  // namespace doppel::app
