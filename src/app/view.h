#pragma once
// `doppel view TARGET`: the page of `up` without physics, for looking at a description.

#include "app/run_twin.h"

namespace CLI {
class App;
}

namespace doppel {
struct RosArguments;
}

namespace doppel::app {

struct ShowOptions {
  bool no_reload = false, headless = false;
  double duration = 0;  // s of wall-clock time; 0: until a signal
  EdgeOptions edges;
};
// Shows the first robot of a scenario without physics. Returns the exit code.
int show_robot(const Scenario& scenario, const ShowOptions& options, Diagnostics& diagnostics,
               const RunHooks& hooks);

// Adds the verb; when it has run, `exit_code` is the program's.
void add_view(CLI::App& app, const RosArguments& ros, int& exit_code);

}  // namespace doppel::app
