// doppel base report: how far a base's odometry is from the truth, and the multipliers that make it true.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "app/described_scenario.h"
#include "app/description_target.h"
#include "app/output.h"
#include "app/print_stderr.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/output_file.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/lab/base_report/base_report.h"
#include "doppel/ros/bus/parameter_file_text.h"
#include "doppel/scenario/compile/robot_setup.h"
#include "doppel/session/live/audit_result.h"

namespace doppel::app {
namespace {

namespace fs = std::filesystem;

struct BaseVerb {
  DescribedBy robot;
  std::string controllers, controller, world, plot;
  bool write = false, json = false;
};

// The file with the controller's parameters. Throws InputError.
fs::path file_to_write(const Scenario& scenario, const std::string& controller) {
  Diagnostics quiet;
  PackageResolver resolver;
  resolver.add_bundled(scenario.bundled_robots);
  const RobotSetup setup = set_up_robot(scenario, scenario.robots.front(), resolver, quiet);
  // A later file has priority over the earlier ones.
  for (auto file = setup.controllers_files.rbegin(); file != setup.controllers_files.rend(); ++file) {
    if (ParameterFile::load(*file).overrides_for("/" + controller, controller).find("wheel_separation") !=
        nullptr)
      return *file;
  }
  throw InputError("base.nothing_to_write", {},
                   fmt::format("no controllers' file has a wheel_separation of {}", controller),
                   "write a controllers' file (`doppel new`), name it with --controllers, and repeat");
}

void write_multipliers(const Scenario& scenario, const BaseReport& report) {
  if (!report.fitted) {
    throw InputError("base.nothing_to_write", {},
                     fmt::format("{} ({}) has no multipliers", report.controller, report.type),
                     "--write is for diff_drive_controller/DiffDriveController");
  }
  const fs::path file = file_to_write(scenario, report.controller);
  const std::string before = read_file(file.string(), kMaxParameterFileBytes);
  write_whole(file, with_multipliers(before, file, report.controller, *report.fitted));
  print_stderr("written to {}\n", shown_path(file));
}

int run_report(const BaseVerb& options) {
  check_output(options.plot);
  Scenario scenario = described_scenario(options.robot);
  if (!options.controllers.empty()) scenario.robots.front().controllers = {options.controllers};
  if (!options.world.empty()) scenario.world = options.world;
  BaseReportOptions wanted;
  wanted.controller = options.controller;
  wanted.on_leg = [](const std::string& leg) { print_stderr("base: {} ...\n", leg); };
  Diagnostics diagnostics;
  if (const auto description = expanded_if_possible(scenario, scenario.robots.front()))
    report_misspellings(*description, diagnostics);
  const BaseReport report = [&] {
    try {
      return report_base(scenario, wanted, diagnostics);
    } catch (const InputError&) {
      print_diagnostics(diagnostics, true);  // they name what was left out
      throw;
    }
  }();
  print_diagnostics(diagnostics);
  if (!options.plot.empty()) deliver(base_report_svg(report), options.plot);
  deliver(options.json ? base_report_json(report) : base_report_text(report));
  if (report.diverged) return 1;
  if (options.write) write_multipliers(scenario, report);
  return 0;
}

}  // namespace

void add_base(CLI::App& app, int& exit_code) {
  CLI::App* verb = app.add_subcommand("base", "Odometry of a mobile base against the truth");
  verb->require_subcommand(1);
  verb->footer("Examples:\n  doppel base report kate\n  doppel base report rover_skid --write");
  const auto options = std::make_shared<BaseVerb>();
  CLI::App* report = verb->add_subcommand(
      "report", "Drive 5 m, 10 rad to each side and squares of 4 m; print slip, drift and the multipliers");
  add_described_by(*report, options->robot);
  report
      ->add_option("--controllers", options->controllers, "Controllers' file (default: found in its package)")
      ->type_name("FILE");
  report->add_option("--controller", options->controller, "Controller of the base, where there are several")
      ->type_name("NAME");
  report->add_option("--world", options->world, "World with the ground to drive on (default: a plane)");
  report->add_option("--plot", options->plot, "Write the squares, true and by odometry, to this file (SVG)")
      ->type_name("FILE");
  report->add_flag("--write", options->write,
                   "Write the multipliers that make odometry true into the controllers' file");
  report->add_flag("--json", options->json, "Print a JSON object to stdout, in m, rad");
  report->footer(
      "The simulated base is driven by its own controller, so that the odometry is that of its encoders.\n"
      "Examples:\n  doppel base report kate\n  doppel base report my_rover.urdf.xacro --plot squares.svg\n"
      "  doppel base report rover_skid --write");
  report->callback([options, &exit_code] { exit_code = run_report(*options); });
}

}  // namespace doppel::app
