#include "app/judgement.h"

#include "app/process.h"
#include "doppel/audit/report_places.h"
#include "doppel/twin/robot_setup.h"

namespace doppel::app {

AuditReport audit_target(DescriptionTarget& target, AuditOptions options) {
  options.package_folder = target.target.package_folder;
  options.datasheet_folder = root_folder() / "datasheets";
  return audit(target.target.description, target.arguments, target.resolver, options);
}

Judgement judge(const std::string& target, const std::function<AuditReport()>& look) {
  const std::filesystem::path here = std::filesystem::current_path();
  try {
    AuditReport report = look();
    shorten_places(report, here);
    return {std::move(report), std::nullopt};
  } catch (const InputError& error) {
    InputError refused = with_short_places(error, here);
    AuditReport report = refusal_report(refused, target);
    return {std::move(report), std::move(refused)};
  }
}

std::string health_json(const Scenario& scenario) {
  const auto look = [&scenario] {
    DescriptionTarget target = open_target(scenario.target, scenario.arguments);
    Diagnostics told_before;
    target.arguments = simulation_arguments(target.target.description, std::move(target.arguments),
                                            target.resolver, told_before);
    AuditOptions options;
    options.controllers = scenario.controllers;
    return audit_target(target, options);
  };
  try {
    return to_json(judge(scenario.target, look).report);
  } catch (const std::exception& error) {
    return to_json(refusal_report(
        InputError("health.failed", {}, std::string("the description could not be judged: ") + error.what()),
        scenario.target));
  }
}

}  // namespace doppel::app
