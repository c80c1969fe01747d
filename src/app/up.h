#pragma once
// `doppel up TARGET`: the twin, its server and its face in the terminal.

namespace CLI {
class App;
}

namespace doppel::app {

// Adds the verb; when it has run, `exit_code` is the program's.
void add_up(CLI::App& app, int& exit_code);

}  // namespace doppel::app
