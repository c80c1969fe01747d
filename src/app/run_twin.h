#pragma once
// A run of a twin from the command line: pace, server, recording, table, browser, and the report at its end.

#include <functional>
#include <string>

#include "app/edge_options.h"
#include "doppel/scenario/schema/scenario.h"
#include "doppel/twin/assembly/twin.h"

namespace CLI {
class App;
}

namespace doppel::app {

// All that does not decide what runs.
struct RunOptions {
  std::string record, write_scenario, speed = "1", cameras;
  double duration = 0, black_box = 30;
  bool no_reload = false, no_rewind = false, verbose = false, headless = false, json = false;
  EdgeOptions edges;
};

// --duration, --speed, --write-scenario, --record, --headless, --json and so on, and those of the edges.
void add_run_options(CLI::App& verb, RunOptions& options);

// Throws InputError: a value that a run cannot have.
void check_run_options(const RunOptions& options);

// A run that has begun.
struct StartedRun {
  const Log& log;
  int port;  // of the server
};

// Actions of others in a run. Each may be empty.
struct RunHooks {
  std::function<std::string(Twin&)> banner;  // lines that follow those of the twin
  std::function<void(const StartedRun&)>
      ready;                    // on the loop's thread: the first step is done, the server answers
  std::function<void()> ended;  // the loop has ended; the log still exists
};

// Until a signal, request_stop() or the end of --duration. Returns the exit code. With --write-scenario it
// prepares the twin, writes its scenario and ends.
int run_twin(const Scenario& scenario, const RunOptions& options, Diagnostics& diagnostics,
             const RunHooks& hooks);

}  // namespace doppel::app
