// doppel validate TARGET: gates and tests of a machine before a motor is powered.
#include "doppel/validation/suite_run/validate.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <thread>

#include "app/described_scenario.h"
#include "app/edge_options.h"
#include "app/number_checks.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/interruptible_work.h"
#include "app/verbs/terminal_shape.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/output_file.h"
#include "doppel/base/math/quantity.h"
#include "doppel/validation/checks/suite.h"
#include "doppel/validation/checks/suite_template.h"
#include "doppel/validation/reports/html_report.h"
#include "doppel/validation/reports/report_formats.h"
#include "doppel/validation/reports/results.h"
#include "doppel/validation/suite_run/preparation.h"
#include "doppel/version.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct ValidateOptions {
  DescribedBy described;
  std::string controllers, world, suite, joint, payload, engine = kDefaultEngine, colour = "auto";
  std::string report, json, junit, sarif, markdown, baseline, tolerance = "5 %";
  std::vector<std::string> only;
  bool quick = false, full = false, strict = false, quiet = false, github = false, no_limits = false,
       list = false, init = false, no_write = false;
  std::uint64_t seed = 1;
  int jobs = 0;
  double max_time = 0;
};

// "0.2@0,0,0.06": kg, and the centre of mass in the tool's link, m.
void read_payload(const std::string& text, ToolLoad& tool) {
  const auto refuse = [&] {
    throw InputError("cli.use", {}, fmt::format("'{}' is not a payload", text),
                     "write kg, or kg@x,y,z with metres in the tool's link: 0.2@0,0,0.06");
  };
  const std::size_t mark = text.find('@');
  const auto mass = parse_quantity(text.substr(0, mark), QuantityKind::mass);
  if (!mass || *mass < 0) refuse();
  tool.mass = *mass;
  if (mark == std::string::npos) return;
  std::string rest = text.substr(mark + 1) + ",";
  for (Eigen::Index i = 0; i < 3; ++i) {
    const std::size_t comma = rest.find(',');
    const auto number = comma == std::string::npos
                            ? std::nullopt
                            : parse_quantity(rest.substr(0, comma), QuantityKind::length);
    if (!number) refuse();
    tool.p_LoC_L[i] = number.value_or(0);
    rest.erase(0, comma + 1);
  }
  if (!rest.empty()) refuse();
}

Scenario scenario_of(const ValidateOptions& options) {
  Scenario out = described_scenario(options.described);
  if (!options.world.empty()) out.world = options.world;
  if (!options.controllers.empty()) out.robots.front().controllers = {options.controllers};
  out.engine = options.engine;
  out.enforce_limits = !options.no_limits;
  return out;
}

void check_outputs(const ValidateOptions& options) {
  for (const std::string& file : {options.json, options.junit, options.sarif, options.markdown}) {
    if (!file.empty()) check_output(file);
  }
}

// A folder with the report for a browser, the results, and recordings of motions that failed; a file that is
// there is replaced as a whole. Recordings come first, so that no report names one that is not there.
void write_report(const fs::path& folder, const ValidationReport& report, const Subject& subject) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    throw InputError("output.unwritable", {},
                     fmt::format("the folder '{}' cannot be made: {}", folder.string(), error.message()));
  for (const CheckResult& check : report.checks) {
    for (const FailureRecording& recording : check.recordings)
      write_whole(folder / recording.file,
                  {reinterpret_cast<const char*>(recording.bytes->data()), recording.bytes->size()});
  }
  write_whole(folder / "index.html", html_report(report, subject.model == nullptr ? nullptr : &subject));
  write_whole(folder / "results.json", to_json(report));
}

void write_outputs(const ValidateOptions& options, const ValidationReport& report, const Subject& subject) {
  if (!options.report.empty()) write_report(options.report, report, subject);
  if (!options.json.empty()) deliver(to_json(report), options.json);
  if (!options.junit.empty()) deliver(to_junit(report), options.junit);
  if (!options.sarif.empty()) deliver(to_sarif(report), options.sarif);
  if (!options.markdown.empty()) deliver(to_markdown(report), options.markdown);
}

void print_result(const ValidateOptions& options, const ValidationReport& report) {
  const bool has_stdout =
      options.json == "-" || options.junit == "-" || options.sarif == "-" || options.markdown == "-";
  if (has_stdout) return;
  if (options.github) return deliver(to_github(report));
  const TerminalShape shape = terminal_shape(options.colour);
  // An interrupted run has written no recording.
  deliver(to_text(report, {shape.colour, shape.width, options.quiet, report.complete ? options.report : ""}));
}

int list_checks() {
  std::string out;
  for (const CheckInfo& info : check_table())
    out += fmt::format("{:4} {:32} {} ({})\n", info.id, info.title, info.decided_by, info.limit);
  deliver(out);
  return 0;
}

// --init: the suite with its defaults and comments.
int write_suite(const Subject& subject) {
  if (!subject.refusal.empty()) throw InputError(subject.refusal);
  const fs::path file = subject.validation_folder() / "suite.yaml";
  if (fs::exists(file)) {
    throw InputError("output.unwritable", make_location(file.string()), "the suite is there already",
                     "edit it, or remove it first");
  }
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  write_whole(file, suite_template(subject));
  deliver(fmt::format("written: {}\n", file.string()));
  return 0;
}

int run_validate(const ValidateOptions& options) {
  if (options.list) return list_checks();
  if (options.described.words.empty())
    throw InputError("cli.use", {}, "no description is named",
                     "run doppel validate TARGET, for example doppel validate omarm_one");
  ValidationOptions how;
  how.effort = options.quick ? Effort::quick : options.full ? Effort::full : Effort::standard;
  how.seed = options.seed;
  how.jobs = options.jobs > 0 ? static_cast<std::size_t>(options.jobs)
                              : std::max(1U, std::thread::hardware_concurrency());
  how.only = check_ids(options.only);
  how.joint = options.joint;
  how.today = today();
  how.strict = options.strict;
  how.record = !options.report.empty();
  how.write_answers = !options.no_write;
  how.max_seconds = options.max_time;
  const auto tolerance = parse_quantity(options.tolerance, QuantityKind::share);
  if (!tolerance || *tolerance < 0)
    throw InputError("cli.use", {}, fmt::format("'{}' is not a tolerance", options.tolerance),
                     "write a share: 5 %");
  std::optional<Baseline> baseline;
  if (!options.baseline.empty()) baseline = read_results(options.baseline);
  check_outputs(options);
  SubjectOptions reading;
  reading.datasheets = bundled_folders().datasheets;
  const Subject subject = read_subject(scenario_of(options), reading);
  if (options.init) return write_suite(subject);
  Suite suite = suite_of(subject, options.suite);
  if (!options.payload.empty()) read_payload(options.payload, suite.tool);
  check_names(subject, suite, options.joint);
  ValidationReport report;
  bool ended = false;
  {
    const InterruptibleWork work("of the checks");
    how.progress = [&](double done, const std::string&) {
      ended = ended || !work.progress(std::min(done, 0.99));
      return !ended;
    };
    report = validate(subject, suite, how);
    if (!ended) static_cast<void>(work.progress(1));
  }
  report.target = options.described.words.front();
  report.version = version();
  if (baseline) {
    report.regressions = regressions(report, *baseline, *tolerance);
    report.improvements = improvements(report, *baseline, *tolerance);
  }
  shorten_places(report, fs::current_path());
  if (ended) {
    print_stderr("\ninterrupted; no file was written\n");
    print_result(options, report);
    return kInterrupted;
  }
  write_outputs(options, report, subject);
  print_result(options, report);
  return report.passed() ? 0 : 1;
}

void add_output_options(CLI::App& verb, ValidateOptions& o) {
  verb.add_option("--report", o.report,
                  "Write index.html, with curves and poses, results.json, and recordings of motions that "
                  "fail into this folder")
      ->type_name("FOLDER");
  verb.add_option("--json", o.json, "Write the results as JSON (schema: doppel man validate.md); -: stdout")
      ->type_name("FILE");
  verb.add_option("--junit", o.junit, "Write JUnit's XML for a test server")->type_name("FILE");
  verb.add_option("--sarif", o.sarif, "Write SARIF 2.1.0 for code scanning")->type_name("FILE");
  verb.add_option("--markdown", o.markdown, "Write GitHub's Markdown, for a job's summary or a comment")
      ->type_name("FILE");
  verb.add_flag("--github", o.github, "Print annotations for GitHub's workflows");
  verb.add_option("--baseline", o.baseline, "Fail where a number is worse than in these results (JSON)")
      ->type_name("FILE");
  verb.add_option("--tolerance", o.tolerance, "By which a number may be worse than in the baseline")
      ->type_name("SHARE");
  verb.add_flag("--strict", o.strict, "Warnings and what is not judged are failures");
  verb.add_flag("-q,--quiet", o.quiet, "Print only failures and the last line");
  verb.add_option("--color,--colour", o.colour, "Colour: auto, always or never")
      ->check(CLI::IsMember({"auto", "always", "never"}));
}

}  // namespace

void add_validate(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ValidateOptions>();
  ValidateOptions& o = *options;
  CLI::App* verb = app.add_subcommand(
      "validate",
      "Test a machine before a motor is powered: fifteen gates and six tests, with numbers and limits");
  add_described_by(*verb, o.described, false);
  verb->add_option("--controllers", o.controllers,
                   "Controllers' parameter file (YAML) to use instead of the description's own")
      ->type_name("FILE");
  verb->add_option("--world", o.world, "World file around the machine; without it there is the ground alone")
      ->type_name("FILE");
  verb->add_option("--suite", o.suite,
                   "Suite file with limits, workspace, tool and waivers (default: validation/suite.yaml of "
                   "the package)")
      ->type_name("FILE");
  auto* quick = verb->add_flag("--quick", o.quick, "Fewer samples: seconds");
  verb->add_flag("--full", o.full, "More samples, and the extras: minutes")->excludes(quick);
  verb->add_option("--only", o.only, "Only these: T4, G13, gates, tests; comma-separated")
      ->delimiter(',')
      ->type_name("ID");
  verb->add_option("--joint", o.joint, "Judge only this joint")->type_name("JOINT");
  verb->add_option("--payload", o.payload,
                   "Mass at the tool in kg, with its place in the tool's link: 0.2@0,0,0.06")
      ->type_name("KG[@X,Y,Z]");
  verb->add_option("--engine", o.engine, "Physics engine")->type_name("NAME");
  verb->add_flag("--no-limits", o.no_limits,
                 "As ros2_control by its defaults: limits are not enforced on commands");
  verb->add_option("--seed", o.seed, "Seed of all samples")->type_name("N");
  verb->add_option("-j,--jobs", o.jobs, "Threads (default: all processors); the results do not depend on it")
      ->type_name("N");
  verb->add_option("--max-time", o.max_time, "Begin no check after this time, s")->type_name("SECONDS");
  verb->add_flag("--no-write", o.no_write, "Do not write validation/tree.txt where it is missing");
  verb->add_flag("--init", o.init,
                 "Write validation/suite.yaml with all defaults and comments, and run nothing");
  verb->add_flag("--list", o.list, "List the gates and tests with what decides them");
  add_output_options(*verb, o);
  verb->footer(
      "Exit code 1: a gate or a test failed, or a number is worse than in the baseline.\n"
      "Examples:\n  doppel validate my_arm.urdf.xacro\n"
      "  doppel validate my_arm --report out              # then open out/index.html\n"
      "  doppel validate my_arm --junit junit.xml --sarif doppel.sarif --markdown \"$GITHUB_STEP_SUMMARY\"\n"
      "  doppel validate my_arm --only T4,G13 --joint \"Revolute 2\" --payload 0.2@0,0,0.06");
  verb->callback([options, &exit_code] { exit_code = run_validate(*options); });
}

}  // namespace doppel::app
