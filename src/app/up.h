#pragma once
// `doppel up TARGET`: the twin, its server and its table in the terminal.

namespace CLI {
class App;
}

namespace doppel {
struct RosArguments;
}

namespace doppel::app {

// Adds the verb; when it has run, `exit_code` is the program's. `ros` is read when it runs.
void add_up(CLI::App& app, const RosArguments& ros, int& exit_code);

}  // namespace doppel::app
