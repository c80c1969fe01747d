// doppel worlds: the worlds that come with the program.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "app/output.h"
#include "app/verbs/verbs.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel::app {

void add_worlds(CLI::App& app, int& exit_code) {
  CLI::App* verb = app.add_subcommand("worlds", "List the bundled worlds");
  verb->footer(
      "Examples:\n  doppel worlds\n  doppel up omarm_one --world table.yaml\n  doppel world info kate_lab");
  verb->callback([&exit_code] {
    const std::vector<BundledWorld> worlds = bundled_worlds();
    std::size_t width = 0;
    for (const BundledWorld& world : worlds) width = std::max(width, world.file.filename().string().size());
    std::string text;
    for (const BundledWorld& world : worlds)
      text += fmt::format("{:<{}}  {}\n", world.file.filename().string(), width, world.about);
    deliver(text);
    exit_code = 0;
  });
}

}  // namespace doppel::app
