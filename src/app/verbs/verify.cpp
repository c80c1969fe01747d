// doppel verify: the accuracy of a robot's motion at the step of its world.
#include "doppel/lab/verification/verify.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>

#include "app/described_scenario.h"
#include "app/description_target.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/motion_subject.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/names.h"
#include "doppel/session/live/audit_result.h"

namespace doppel::app {
namespace {

constexpr double kMinSteps = 10, kMaxSteps = 2e5;  // of which samples are kept

struct VerifyVerb {
  DescribedBy robot;
  std::string world, base = "auto", tool, integrator, plot;
  std::vector<std::string> motions;
  double duration = 2.0, step = 0;
  std::optional<double> within;
  bool json = false;
};

std::vector<MotionKind> chosen_motions(const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const MotionKind kind : kMotions) known.emplace_back(name_of(kind));
  std::vector<MotionKind> out;
  for (const std::string& name : names) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end()) {
      throw InputError("cli.scenario", {},
                       fmt::format("unknown scenario '{}'{}", name, did_you_mean(name, known)),
                       "choose one of smooth, fall, hold and move");
    }
    out.push_back(kMotions[at - known.begin()]);
  }
  return out;
}

void check_numbers(const VerifyVerb& options) {
  check_duration(options.duration);
  if (options.step != 0 && !(options.step >= kMinStep && options.step <= kMaxStep)) {
    throw InputError(
        "cli.step", {},
        fmt::format("--step is {} s, but must be from {} to {}", options.step, kMinStep, kMaxStep),
        "write 0.001 for a step of 1 ms");
  }
  if (options.within && !(*options.within > 0 && std::isfinite(*options.within)))
    throw InputError("cli.within", {}, "--within must be a positive error, rad (m for prismatic joints)");
}

// False: a motion diverges, or its error exceeds the limit of the user.
bool good(const Verification& of, const std::optional<double>& within) {
  for (const MotionVerdict& motion : of.motions) {
    if (motion.runs_away_after) return false;
    if (within && std::max(motion.largest(false), motion.largest(true)) > *within) return false;
  }
  return true;
}

int run_verify(const VerifyVerb& options) {
  check_numbers(options);
  check_output(options.plot);
  Scenario scenario = described_scenario(options.robot);
  if (!options.world.empty()) scenario.world = options.world;
  if (options.base != "auto")
    scenario.robots.front().base = options.base == "floating" ? BaseKind::floating : BaseKind::fixed;
  VerifyOptions wanted;
  wanted.duration = options.duration;
  wanted.motions = chosen_motions(options.motions);
  wanted.tool = options.tool;
  wanted.on_run = [last = std::chrono::steady_clock::now()](MotionKind kind, int run) mutable {
    const auto now = std::chrono::steady_clock::now();
    if (now - last < kProgressPeriod) return;
    last = now;
    print_stderr("verify: {}, run {} of {} ...\n", name_of(kind), run, kRuns);
  };
  Diagnostics diagnostics;
  CompiledScenario machine(scenario, diagnostics);
  for (const auto& robot : machine.robots) report_misspellings(*robot, diagnostics);
  print_diagnostics(diagnostics);
  if (!options.plot.empty()) {
    const std::vector<std::filesystem::path> sources = machine.files();
    refuse_own_source(options.plot, sources, "write the plot to another file");
  }
  MotionSubject subject = motion_subject(machine);
  WorldSettings& world = subject.world;
  if (options.step > 0) world.step = from_seconds(options.step);
  if (!options.integrator.empty()) world.integrator = integrator_named(options.integrator, "cli.integrator");
  const double steps = options.duration / to_seconds(world.step);
  if (!(steps >= kMinSteps && steps <= kMaxSteps)) {
    throw InputError("cli.duration", {},
                     fmt::format("{} s are {:.0f} steps of {:g} ms, but must be from {:.0f} to {:.0f}",
                                 options.duration, steps, to_seconds(world.step) * 1e3, kMinSteps, kMaxSteps),
                     "change --duration or --step");
  }
  const Verification result = verify(subject, wanted);
  if (!options.plot.empty()) deliver(verification_svg(result), options.plot);
  deliver(options.json ? verification_json(result) : verification_text(result));
  return good(result, options.within) ? 0 : 1;
}

}  // namespace

void add_verify(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<VerifyVerb>();
  CLI::App* verb = app.add_subcommand("verify", "Measure the integration error at the step of the world");
  add_described_by(*verb, options->robot);
  verb->add_option("--world", options->world, "World file (YAML) with the step and the integrator to verify");
  verb->add_option("--scenario", options->motions,
                   "smooth (a fall without drives, friction, limits, contacts), fall, hold or move (a "
                   "quintic); comma-separated(default: all)")
      ->delimiter(',');
  verb->add_option("--duration", options->duration, "Simulated seconds of each motion")
      ->type_name("S")
      ->capture_default_str();
  verb->add_option("--step", options->step, "Step to use instead of the world's")->type_name("S");
  verb->add_option("--integrator", options->integrator,
                   "Integrator to use instead of the world's: euler, midpoint, rk4 or implicit");
  verb->add_option("--tool", options->tool, "Link whose path error is reported (default: found by name)")
      ->type_name("LINK");
  verb->add_option("--base", options->base, "Base of a robot without a link 'world': fixed, floating or auto")
      ->check(CLI::IsMember({"auto", "fixed", "floating"}));
  verb->add_option("--plot", options->plot, "Write a plot of the errors over time (SVG) to this file")
      ->type_name("FILE");
  verb->add_option("--within", options->within,
                   "Exit code 1 if the error of a joint is larger, rad (m for prismatic joints)");
  verb->add_flag("--json", options->json, "Print a JSON object to stdout, in rad, m, s");
  verb->footer(
      "Runs the robot at h, h/2 and h/4 and compares. Exit code 1: a motion diverges.\nExamples:\n  doppel "
      "verify omarm_one\n  doppel verify my_arm.urdf --scenario move --plot error.svg\n  doppel verify "
      "my_arm.urdf --integrator midpoint --within 1e-3");
  verb->callback([options, &exit_code] { exit_code = run_verify(*options); });
}

}  // namespace doppel::app
