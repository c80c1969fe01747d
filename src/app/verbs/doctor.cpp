// doppel doctor: checks the configuration of this machine.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <memory>

#include "app/edge_options.h"
#include "app/output.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/installation.h"
#include "doppel/review/doctor/findings.h"
#include "doppel/version.h"

namespace doppel::app {
namespace {

int run_doctor(bool json) {
  const doctor::Machine machine =
      doctor::gather_facts({std::string(version()), data_folder(), page_folder()});
  const std::vector<doctor::Finding> findings = doctor::judge(machine);
  const bool coloured = isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr;
  deliver(json ? doctor::report_json(machine, findings) : doctor::report_text(findings, coloured));
  return doctor::has_problem(findings) ? 1 : 0;
}

}  // namespace

void add_doctor(CLI::App& app, int& exit_code) {
  const auto json = std::make_shared<bool>(false);
  CLI::App* verb = app.add_subcommand("doctor", "Check this machine: what limits a twin, and what to do");
  verb->add_flag("--json", *json, "Print a JSON object to stdout");
  verb->footer(
      "Examples:\n  doppel doctor\n  doppel doctor --json\nExit code 1: something prevents `doppel up`.");
  verb->callback([json, &exit_code] { exit_code = run_doctor(*json); });
}

}  // namespace doppel::app
