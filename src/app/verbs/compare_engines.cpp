// doppel compare-engines: the same robot, world and commands in several physics engines.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>

#include "app/described_scenario.h"
#include "app/description_target.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/motion_subject.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/read_file.h"
#include "doppel/lab/verification/compare.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/trajectory_msgs.h"
#include "doppel/session/live/audit_result.h"

namespace doppel::app {
namespace {

constexpr const char* kTrajectory = "trajectory_msgs/msg/JointTrajectory";

struct CompareVerb {
  DescribedBy robot;
  std::vector<std::string> scenarios, engines;
  std::string world, tool, plot;
  double duration = 2.0;
  bool json = false;
};

[[noreturn]] void refuse(const std::string& rule, const std::string& message, const std::string& fix) {
  throw InputError(rule, {}, message, fix);
}

[[noreturn]] void refuse_trajectory(const std::filesystem::path& file, const std::string& why,
                                    const std::string& fix) {
  refuse("cli.trajectory", fmt::format("{}: {}", file.string(), why), fix);
}

// Every joint has to exist in the robot, and be named once.
void check_joints(const std::filesystem::path& file, const std::vector<std::string>& joints,
                  const Model& model) {
  const std::vector<std::string> driven = model.driven_joint_names();
  for (const std::string& name : joints) {
    if (std::ranges::find(driven, name) == driven.end() && model.find_joint(name) < 0)
      refuse_trajectory(file, fmt::format("the robot has no joint '{}'{}", name, did_you_mean(name, driven)),
                        "use joint names of the robot; `doppel tree` prints them");
    if (std::ranges::count(joints, name) > 1)
      refuse_trajectory(file, fmt::format("the joint '{}' is listed twice", name), "list each joint once");
  }
}

// `last`: time of the point before, s; -1 for the first.
void check_point(const std::filesystem::path& file, std::size_t number,
                 const trajectory_msgs::msg::JointTrajectoryPoint& point, double time, std::size_t joints,
                 double last) {
  if (point.positions.size() != joints)
    refuse_trajectory(
        file, fmt::format("point {} has {} positions for {} joints", number, point.positions.size(), joints),
        "give one position per joint");
  if (!std::ranges::all_of(point.positions, [](double q) { return std::isfinite(q); }))
    refuse_trajectory(file, fmt::format("a position of point {} is not a finite number", number),
                      "write finite positions in rad or m");
  if (time < 0)
    refuse_trajectory(file, fmt::format("point {} is at {} s, before the start", number, time),
                      "start time_from_start at 0 or later");
  if (!(time > last))
    refuse_trajectory(file, fmt::format("point {} is at {} s, not after the one before", number, time),
                      "make time_from_start increase");
}

// A trajectory as `doppel topic pub` takes it.
JointPath read_path(const std::filesystem::path& file, const Model& model) {
  constexpr std::size_t kMaxTrajectoryBytes = std::size_t{16} << 20;
  const FileContent content = read_content(file, kMaxTrajectoryBytes);
  if (!content.was_read())
    refuse("cli.trajectory",
           content.is_missing ? fmt::format("file '{}' does not exist", file.string())
                              : fmt::format("file '{}' cannot be read: {}", file.string(), content.problem),
           "give the path of a YAML file");
  Bytes cdr;
  trajectory_msgs::msg::JointTrajectory trajectory;
  Status read = find_type(kTrajectory)->yaml_to_cdr(content.bytes, cdr);
  if (read.ok()) read = from_cdr(cdr, trajectory);
  if (!read.ok())
    refuse("cli.trajectory", fmt::format("{}:{}", file.string(), read.why()),
           fmt::format("write it as a {}: joint_names, and points with positions and time_from_start",
                       kTrajectory));
  JointPath out;
  out.joints = trajectory.joint_names;
  check_joints(file, out.joints, model);
  if (out.joints.empty() || trajectory.points.empty())
    refuse_trajectory(file, "the trajectory has no joints or no points, so nothing would move",
                      "write joint_names, and points with positions and time_from_start");
  for (const auto& point : trajectory.points) {
    const double time = point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec;
    check_point(file, out.times.size() + 1, point, time, out.joints.size(),
                out.times.empty() ? -1.0 : out.times.back());
    out.times.push_back(time);
    out.positions.push_back(point.positions);
  }
  return out;
}

// The part after the end of the motions is not compared.
void warn_of_motion(const std::filesystem::path& file, const JointPath& path, double duration) {
  if (path.times.back() <= duration) return;
  Diagnostics out;
  out.warning("cli.trajectory", make_location(file.string()),
              fmt::format("the trajectory takes {:g} s, of which the first {:g} are compared",
                          path.times.back(), duration),
              fmt::format("--duration {:g} covers all of it", std::ceil(path.times.back())));
  print_diagnostics(out);
}

struct Chosen {
  bool statics = false;
  std::vector<MotionKind> motions;
  std::string trajectory;  // file
};

// "statics", a motion, or "trajectory" and a file behind it.
Chosen chosen_scenarios(const std::vector<std::string>& names) {
  Chosen out;
  std::vector<std::string> known{"statics", "trajectory"};
  for (const MotionKind kind : kMotions) known.emplace_back(name_of(kind));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto motion =
        std::ranges::find(kMotions, names[i], [](MotionKind kind) { return std::string(name_of(kind)); });
    if (names[i] == "statics") {
      out.statics = true;
    } else if (names[i] == "trajectory" && i + 1 < names.size()) {
      out.motions.push_back(MotionKind::path);
      out.trajectory = names[++i];
    } else if (names[i] == "trajectory") {
      refuse("cli.scenario", "--scenario trajectory needs a trajectory file",
             "write --scenario trajectory FILE.yaml");
    } else if (motion == std::end(kMotions)) {
      refuse("cli.scenario", fmt::format("unknown scenario '{}'{}", names[i], did_you_mean(names[i], known)),
             "choose one of statics, smooth, fall, hold, move and trajectory FILE");
    } else {
      out.motions.push_back(*motion);
    }
  }
  if (names.empty()) {
    out.statics = true;
    out.motions.assign(std::begin(kMotions), std::end(kMotions));
  }
  return out;
}

std::vector<std::string> chosen_engines(const std::vector<std::string>& asked) {
  std::vector<std::string> out = asked;
  if (asked.empty()) {
    for (const KnownEngine& engine : known_engines()) {
      if (engine.available) out.push_back(engine.name);
    }
  }
  for (const std::string& name : out) {
    static_cast<void>(engine_module(name));  // throws for an unknown engine
    if (std::ranges::count(out, name) > 1)
      refuse("cli.engines", fmt::format("the engine '{}' is listed twice; there is nothing to compare", name),
             "list different engines; `doppel engines` prints them");
  }
  if (out.size() < 2) {
    refuse("cli.engines", fmt::format("there is only one engine to compare: {}", fmt::join(out, ", ")),
           "list two with --engines a,b; `doppel engines` prints what to install for more");
  }
  return out;
}

// Makes the folder. Throws InputError where no plot can be written into it.
void prepare_plots(const std::string& folder) {
  if (folder.empty()) return;
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  check_output((std::filesystem::path(folder) / "plot.svg").string());
}

void write_plots(const Comparison& result, const std::string& folder) {
  for (const MotionComparison& motion : result.motions)
    deliver(comparison_svg(result, motion),
            (std::filesystem::path(folder) / fmt::format("{}.svg", name_of(motion.kind))).string());
}

int run_compare(const CompareVerb& options) {
  prepare_plots(options.plot);
  check_duration(options.duration);
  const Chosen chosen = chosen_scenarios(options.scenarios);
  const std::vector<std::string> names = chosen_engines(options.engines);
  Scenario scenario = described_scenario(options.robot);
  if (!options.world.empty()) scenario.world = options.world;
  Diagnostics diagnostics;
  CompiledScenario machine(scenario, diagnostics);
  for (const auto& robot : machine.robots) report_misspellings(*robot, diagnostics);
  print_diagnostics(diagnostics);
  MotionSubject subject = motion_subject(machine);
  if (!chosen.trajectory.empty()) {
    subject.path = read_path(chosen.trajectory, *subject.robot.model);
    warn_of_motion(chosen.trajectory, subject.path, options.duration);
  }
  std::vector<ComparedEngine> engines;
  for (const std::string& name : names) {
    const EngineCapabilities& can = engine_module(name).capabilities;
    Diagnostics lacks;
    report_missing_capabilities(can, subject.world, {&subject.robot, 1}, lacks);
    print_diagnostics(lacks);
    engines.push_back({subject, fmt::format("{} {}", can.name, can.version)});
    engines.back().subject.engine = name;
  }
  CompareOptions wanted;
  wanted.duration = options.duration;
  wanted.statics = chosen.statics;
  wanted.motions = chosen.motions;
  wanted.tool = options.tool;
  wanted.on_run = [last = std::chrono::steady_clock::now()](const std::string& what,
                                                            const std::string& engine) mutable {
    const auto now = std::chrono::steady_clock::now();
    if (now - last < kProgressPeriod) return;
    last = now;
    print_stderr("compare-engines: {} in {} ...\n", what, engine);
  };
  const Comparison result = compare_engines(engines, wanted);
  if (!options.plot.empty()) write_plots(result, options.plot);
  deliver(options.json ? comparison_json(result) : comparison_text(result));
  return result.explained() ? 0 : 1;
}

}  // namespace

void add_compare_engines(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<CompareVerb>();
  CLI::App* verb = app.add_subcommand(
      "compare-engines",
      "Run the same robot, world and commands in several physics engines and report differences");
  add_described_by(*verb, options->robot);
  verb->add_option("--scenario", options->scenarios,
                   "statics (poses and efforts without time), smooth (a fall without drives, friction, "
                   "limits, contacts), fall, hold, move (a quintic), or trajectory FILE; comma-separated; "
                   "default: all but the last")
      ->delimiter(',');
  verb->add_option("--engines", options->engines, "At least two, comma-separated (default: all available)")
      ->delimiter(',')
      ->type_name("A,B");
  verb->add_option("--world", options->world, "World file (YAML)");
  verb->add_option("--duration", options->duration, "Simulated seconds of each motion")
      ->type_name("S")
      ->capture_default_str();
  verb->add_option("--tool", options->tool, "Link whose path is compared too (default: found by name)")
      ->type_name("LINK");
  verb->add_option("--plot", options->plot, "Write a plot of each motion (SVG) to this folder")
      ->type_name("DIR");
  verb->add_flag("--json", options->json, "Print a JSON object to stdout, in rad, m, s, N m, N");
  verb->footer(
      "Each difference is printed with each engine's own error, estimated at half the step. Exit code 1: a "
      "difference is\nunexplained.\nExamples:\n  doppel compare-engines omarm_one\n  doppel compare-engines "
      "my_arm.urdf --scenario statics --json\n  doppel compare-engines my_arm.urdf --scenario trajectory "
      "pick.yaml --plot curves");
  verb->callback([options, &exit_code] { exit_code = run_compare(*options); });
}

}  // namespace doppel::app
