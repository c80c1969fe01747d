// doppel mass: the mass and centre of mass of each link, and the gravity loads of the joints.
#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/description_target.h"
#include "app/output.h"
#include "app/verbs/verbs.h"
#include "doppel/review/conversion/mass_report.h"

namespace doppel::app {
namespace {

using Json = nlohmann::ordered_json;

struct MassOptions {
  std::vector<std::string> target;
  double measured = 0;
  bool json = false;
};

Json vector_json(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

std::string masses_as_json(const std::string& robot, const MassReport& report, double measured) {
  Json out{{"version", 1}, {"robot", robot}, {"mass", report.total}, {"com", vector_json(report.com)}};
  if (measured > 0) out["measured"] = measured;
  out["links"] = Json::array();
  for (const LinkMass& link : report.links) {
    out["links"].push_back({{"name", link.link},
                            {"mass", link.mass},
                            {"share", link.share},
                            {"com", vector_json(link.com)},
                            {"gyration", link.gyration},
                            {"principal_moments", vector_json(link.moments)}});
  }
  out["joints"] = Json::array();
  for (const JointLoad& load : report.joints) {
    Json joint{{"name", load.joint}, {"gravity_at_zero", load.at_zero}, {"gravity_at_worst", load.worst}};
    joint["effort"] = load.effort ? Json(*load.effort) : Json();
    joint["margin"] = load.margin ? Json(*load.margin) : Json();
    out["joints"].push_back(std::move(joint));
  }
  return out.dump(2) + "\n";
}

int run_mass(const MassOptions& options) {
  if (options.measured < 0 || !std::isfinite(options.measured)) {
    throw InputError("cli.measured", {}, "--measured must be a positive number of kilograms",
                     "give the measured mass of the whole robot, for example --measured 1.283");
  }
  DescriptionTarget target = open_target(options.target);
  const RobotDescription robot = load_target(target).robot;
  Diagnostics diagnostics;
  const MassReport report = mass_report(compile_model(robot, BaseKind::fixed, diagnostics));
  print_diagnostics(diagnostics);
  if (options.json) {
    deliver(masses_as_json(robot.name, report, options.measured));
    return 0;
  }
  std::string text = mass_text(report);
  if (options.measured > 0) text += "\n" + compared_with_scale(report, options.measured);
  deliver(text);
  return 0;
}

}  // namespace

void add_mass(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<MassOptions>();
  CLI::App* verb = app.add_subcommand("mass", "Print masses, centres of mass, inertias and joint loads");
  add_target(*verb, options->target);
  verb->add_option("--measured", options->measured, "Measured mass of the whole robot, kg")->type_name("KG");
  verb->add_flag("--json", options->json, "Print a JSON object to stdout, in kg, m, N m");
  verb->footer("Examples:\n  doppel mass omarm_one\n  doppel mass my_arm.urdf --measured 1.283");
  verb->callback([options, &exit_code] { exit_code = run_mass(*options); });
}

}  // namespace doppel::app
