#pragma once
// `doppel launch FILE`: the launch files that people have, without ROS.

namespace CLI {
class App;
}

namespace doppel::app {

// Adds the verb; when it has run, `exit_code` is the program's.
void add_launch(CLI::App& app, int& exit_code);

}  // namespace doppel::app
