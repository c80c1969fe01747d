// doppel engines: the supported physics engines, and the features of each.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/output.h"
#include "app/verbs/verbs.h"
#include "doppel/lab/verification/engine_table.h"

namespace doppel::app {
namespace {

struct EnginesVerb {
  bool json = false, markdown = false;
};

int run_engines(const EnginesVerb& options) {
  deliver(options.json ? engines_json() : options.markdown ? engines_markdown() : engines_text());
  return 0;
}

}  // namespace

void add_engines(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<EnginesVerb>();
  CLI::App* verb = app.add_subcommand("engines", "List physics engines and their capabilities");
  CLI::Option* json = verb->add_flag("--json", options->json, "Print a JSON object to stdout");
  verb->add_flag("--markdown", options->markdown, "Print the tables of the page engines.md as Markdown")
      ->excludes(json);
  verb->footer(
      "Examples:\n  doppel engines\n  doppel engines --json\n  doppel up omarm_one --engine bullet\n"
      "  doppel compare-engines omarm_one");
  verb->callback([options, &exit_code] { exit_code = run_engines(*options); });
}

}  // namespace doppel::app
