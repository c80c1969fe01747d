// doppel check TARGET: the audit on the command line.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "app/described_scenario.h"
#include "app/description_target.h"
#include "app/edge_options.h"
#include "app/print_stderr.h"
#include "app/verbs/terminal_shape.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/review/audit/report_places.h"
#include "doppel/session/live/audit_result.h"

namespace doppel::app {
namespace {

struct CheckOptions {
  std::vector<std::string> words, profiles;
  bool json = false, sarif = false, github = false, list_rules = false, markdown = false, fix = false,
       quiet = false, rest = false;
  std::string datasheet, controllers, colour = "auto";
};

unsigned chosen_profiles(const std::vector<std::string>& names) {
  const std::vector<std::string> known{"gazebo", "moveit", "mujoco", "ros2_control", "all"};
  unsigned chosen = 0;
  for (const std::string& name : names) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end()) {
      throw InputError("cli.use", {},
                       fmt::format("'{}' is not a profile{}", name, did_you_mean(name, known)));
    }
    chosen |= name == "all" ? kAllProfiles : 1u << (at - known.begin());
  }
  return chosen == 0 ? kAllProfiles : chosen;
}

TextStyle style_for(const std::string& colour) {
  const TerminalShape shape = terminal_shape(colour);
  return {shape.colour, shape.width};
}

// Every repair with the fingerprint of what it corrects: the description with the ones before it applied.
std::vector<Operation> repairs_of(const AuditReport& report, DescriptionTarget& target) {
  Diagnostics ignored;
  ExpandedDescription description =
      expand_corrected(target.target.description, target.arguments, target.resolver, ignored);
  std::vector<Operation> out;
  for (const Finding& finding : report.findings) {
    for (Operation repair : finding.repair) {
      // Behind the rule's own evidence: a line of a datasheet is more specific than the finding.
      repair.evidence.push_back(fmt::format("doppel check: {}: {}", finding.rule, finding.message));
      take_fingerprint(repair, description);
      apply_overlay({{}, {repair}}, description, target.resolver, ignored);
      out.push_back(std::move(repair));
    }
  }
  return out;
}

// Writes the repairs that are uniquely determined, reports them, and runs the audit again.
AuditReport fix(DescriptionTarget& target, const AuditOptions& options, const AuditReport& before,
                bool quiet) {
  const std::vector<Operation> repairs = repairs_of(before, target);
  if (repairs.empty()) {
    if (!quiet) print_stderr("nothing to fix: no finding has exactly one repair\n");
    return before;
  }
  const auto file = add_to_overlay(target.target.description, repairs);
  if (!quiet) {
    print_stderr("wrote {} correction{} to {}:\n", repairs.size(), repairs.size() == 1 ? "" : "s",
                 file.string());
    for (const Operation& repair : repairs) print_stderr("  {}\n", describe(repair.action));
    print_stderr("\n");
  }
  return audit_target(target, options);
}

void print_report(const AuditReport& report, const CheckOptions& o) {
  if (o.json) return fmt::print("{}", to_json(report));
  if (o.sarif) return fmt::print("{}", to_sarif(report));
  if (o.github) return fmt::print("{}", to_github(report));
  TextStyle style = style_for(o.colour);
  style.summary_only = o.quiet;
  fmt::print("{}", to_text(report, style));
}

// Findings of a second of simulation come first, because errors are first in a report.
void add_run(const CheckOptions& o, const DescriptionTarget& target, AuditReport& report) {
  Scenario scenario = described_scenario({o.words, {}});
  if (!o.controllers.empty()) scenario.robots.front().controllers = {o.controllers};
  std::vector<Finding> found;
  try {
    found = audit_run(scenario);
  } catch (const InputError& error) {
    found = refusal_report(error, target.target.description).findings;
    for (Finding& finding : found) {
      finding.rule = "run.refused";
      finding.subject = fmt::format("robot '{}'", report.robot);
    }
  }
  report.findings.insert(report.findings.begin(), std::make_move_iterator(found.begin()),
                         std::make_move_iterator(found.end()));
}

AuditResult audited(const CheckOptions& o, AuditOptions options) {
  options.datasheet_folder = bundled_folders().datasheets;
  if (!o.datasheet.empty()) options.datasheet = o.datasheet;
  if (!o.controllers.empty()) options.controllers = o.controllers;
  return audit_result(o.words.front(), [&] {
    DescriptionTarget target = open_target(o.words);
    AuditReport report = audit_target(target, options);
    if (o.fix) report = fix(target, options, report, o.quiet);
    if (o.rest) add_run(o, target, report);
    return report;
  });
}

int check(const CheckOptions& o) {
  if (o.list_rules) {
    fmt::print("{}", o.markdown ? rules_markdown() : rules_text(style_for(o.colour)));
    return 0;
  }
  if (o.words.empty()) {
    throw InputError("cli.use", {}, "no description is given",
                     "run doppel check TARGET, for example doppel check omarm_one");
  }
  AuditOptions options;
  options.profiles = chosen_profiles(o.profiles);
  const AuditResult result = audited(o, options);
  // Programs get the error in the report; for people it is printed on stderr.
  if (!result.refused || o.json || o.sarif || o.github) print_report(result.report, o);
  if (result.refused) throw InputError(*result.refused);
  return result.report.count(Severity::error) > 0 ? 1 : 0;
}

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CheckOptions>();
  CheckOptions& o = *options;
  CLI::App* verb =
      app.add_subcommand("check", "Report what is wrong with a description, where, and how to fix it");
  verb->add_option("TARGET", o.words,
                   "Name of a bundled robot, a .urdf or .xacro file, or a folder with a ROS package or "
                   "workspace, and name:=value arguments for xacro");
  auto* json = verb->add_flag("--json", o.json, "Print findings as JSON");
  auto* sarif = verb->add_flag("--sarif", o.sarif, "Print findings as SARIF 2.1.0 for code scanning");
  auto* github = verb->add_flag("--github", o.github, "Print findings as GitHub workflow annotations");
  json->excludes(sarif)->excludes(github);
  sarif->excludes(github);
  verb->add_option("--profile", o.profiles,
                   "Report only what concerns gazebo, moveit, mujoco or ros2_control; comma-separated")
      ->delimiter(',');
  verb->add_flag("--list-rules", o.list_rules, "List every rule with the failure it prevents");
  verb->add_flag("--markdown", o.markdown, "With --list-rules: print Markdown, as in 'doppel man rules.md'");
  verb->add_option("--datasheet", o.datasheet,
                   "Compare limits with a datasheet: a YAML file or the name of a bundled one");
  verb->add_option("--controllers", o.controllers,
                   "Controllers' parameter file (YAML) to use instead of the description's own");
  verb->add_flag("--fix", o.fix, "Write every unambiguous repair to the overlay");
  verb->add_option("--color,--colour", o.colour, "Colour: auto, always or never")
      ->check(CLI::IsMember({"auto", "always", "never"}));
  verb->add_flag(
      "--rest", o.rest,
      "Also simulate one second without commands; a joint that moves, oscillates or diverges is an error");
  verb->add_flag("-q,--quiet", o.quiet, "Print only the last line, with the counts");
  verb->footer(
      "Examples:\n  doppel check my_arm.urdf.xacro\n  doppel check omarm_one --rest          # also "
      "simulates it for a "
      "second\n  doppel check my_arm.urdf --fix          # writes repairs to the overlay");
  verb->callback([options, &exit_code] { exit_code = check(*options); });
}

}  // namespace doppel::app
