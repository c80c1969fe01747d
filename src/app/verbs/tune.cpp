// doppel tune TARGET: gains of its controllers that pass T4, from a model, verified in the twin.
#include "doppel/validation/tuning/tune.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <numbers>
#include <thread>

#include "app/described_scenario.h"
#include "app/edge_options.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/interruptible_work.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/output_file.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/ros/bus/parameter_file_text.h"
#include "doppel/version.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct TuneVerb {
  DescribedBy described;
  std::string controllers, suite, joint, engine = kDefaultEngine, json;
  double bandwidth = 0, delay = 0;
  int jobs = 0;
  bool relay = false, write = false;
};

bool is_within(const fs::path& file, const fs::path& folder) {
  std::error_code none;
  const fs::path inner = fs::weakly_canonical(file, none), outer = fs::weakly_canonical(folder, none);
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

// The file that --write changes, checked before the work.
void check_write(const Subject& subject, const Scenario& scenario) {
  const auto& files = subject.robot().setup().controllers_files;
  if (files.empty()) {
    throw InputError("tune.nothing_to_write", {},
                     "the robot has no controllers' file: its controllers are generated",
                     "write one (`doppel new` makes an example), and name it with --controllers");
  }
  for (const fs::path& file : files) {
    if (is_within(file, scenario.bundled_robots)) {
      throw InputError("tune.bundled", make_location(file.string()),
                       "a robot that ships with doppel is not changed",
                       fmt::format("copy the file, and run `doppel tune {} --controllers COPY.yaml --write`",
                                   subject.scenario.robots.front().target));
    }
    check_writable(file);
  }
}

Suite suite_of(const TuneVerb& options, const Subject& subject) {
  if (!options.suite.empty()) return load_suite(options.suite);
  const fs::path file = subject.validation_folder() / "suite.yaml";
  return fs::exists(file) ? load_suite(file) : Suite{};
}

void check_joint(const TuneVerb& options, const Subject& subject) {
  const std::vector<std::string> joints = subject.model->driven_joint_names();
  if (options.joint.empty() || std::ranges::find(joints, options.joint) != joints.end()) return;
  throw InputError(
      "cli.use", {},
      fmt::format("the robot has no driven joint '{}'{}", options.joint, did_you_mean(options.joint, joints)),
      "doppel tree lists links and joints");
}

Subject subject_of(const TuneVerb& options) {
  Scenario scenario = described_scenario(options.described);
  if (!options.controllers.empty()) scenario.robots.front().controllers = {options.controllers};
  scenario.engine = options.engine;
  SubjectOptions reading;
  reading.datasheets = bundled_folders().datasheets;
  Subject out = read_subject(scenario, reading);
  if (!out.refusal.empty()) throw InputError(out.refusal);
  return out;
}

void write_gains(const Subject& subject, const TuneReport& report) {
  const fs::path file = gains_file(subject, report);
  const std::string before = read_file(file.string(), kMaxParameterFileBytes);
  const std::string after = with_new_gains(before, file, report);
  if (after == before) {
    print_stderr("{} has these gains already\n", shown_path(file));
    return;
  }
  write_whole(file, after);
  print_stderr("written to {}\n", shown_path(file));
}

int run_tune(const TuneVerb& verb) {
  if (!verb.json.empty()) check_output(verb.json);
  const Subject subject = subject_of(verb);
  check_joint(verb, subject);
  const Suite suite = suite_of(verb, subject);
  if (verb.write) check_write(subject, described_scenario(verb.described));
  TuneOptions how;
  how.joint = verb.joint;
  if (verb.bandwidth > 0) how.bandwidth = 2 * std::numbers::pi * verb.bandwidth;
  how.transport = verb.delay;
  how.relay = verb.relay;
  how.jobs =
      verb.jobs > 0 ? static_cast<std::size_t>(verb.jobs) : std::max(1U, std::thread::hardware_concurrency());
  TuneReport report;
  try {
    const InterruptibleWork work("of the work");
    how.progress = [&](double done, const std::string&) { return work.progress(done); };
    report = tune(subject, suite, how);
    static_cast<void>(work.progress(1));
  } catch (const CheckCancelled&) {
    return interrupted_without_output();
  }
  report.target = verb.described.words.front();
  report.version = version();
  if (!verb.json.empty()) deliver(to_json(report), verb.json);
  if (verb.json != "-") deliver(to_text(report));
  if (!report.passed()) {
    if (verb.write) print_stderr("nothing was written: no gains were found that pass\n");
    return 1;
  }
  if (verb.write && report.any_gains_act()) write_gains(subject, report);
  if (verb.write && !report.any_gains_act()) print_stderr("nothing was written: no gains act\n");
  return 0;
}

}  // namespace

void add_tune(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<TuneVerb>();
  TuneVerb& o = *options;
  CLI::App* verb = app.add_subcommand(
      "tune", "Gains of the controllers that pass the step response T4 with margin, verified in the twin");
  add_described_by(*verb, o.described);
  verb->add_flag(
      "--write", o.write,
      "Write the gains into the controllers' file; only their numbers change, and only if they pass");
  verb->add_option("--controllers", o.controllers,
                   "Controllers' parameter file (YAML) to use instead of the description's own")
      ->type_name("FILE");
  verb->add_option("--suite", o.suite,
                   "Suite file with limits and payload (default: validation/suite.yaml of the package)")
      ->type_name("FILE");
  verb->add_option("--joint", o.joint, "Tune only this joint")->type_name("JOINT");
  verb->add_option("--bandwidth", o.bandwidth,
                   "Bandwidth to aim at (default: the highest one with the margins)")
      ->check(CLI::PositiveNumber)
      ->type_name("HZ");
  verb->add_option("--delay", o.delay,
                   "Delay of the real arm's bus and drives besides the controller's period, s")
      ->check(CLI::Range(0.0, 0.2))
      ->type_name("SECONDS");
  verb->add_flag(
      "--relay", o.relay,
      "Check the models by a relay in the twin; print what Ziegler-Nichols' and others' rules give");
  verb->add_option("--engine", o.engine, "Physics engine")->type_name("NAME");
  verb->add_option("-j,--jobs", o.jobs, "Threads (default: all processors); the results do not depend on it")
      ->type_name("N");
  verb->add_option("--json", o.json, "Write the result as JSON; -: stdout, instead of the text")
      ->type_name("FILE");
  verb->footer(
      "Exit code 1: no gains were found that pass.\n"
      "Examples:\n  doppel tune omarm_one\n  doppel tune my_arm.urdf.xacro --write\n"
      "  doppel tune my_arm --joint \"Revolute 2\" --bandwidth 4 --relay");
  verb->callback([options, &exit_code] { exit_code = run_tune(*options); });
}

}  // namespace doppel::app
