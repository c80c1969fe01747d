#pragma once
// `doppel view TARGET`: the page of `up` without physics, for looking at a description.

namespace CLI {
class App;
}

namespace doppel {
struct RosArguments;
}

namespace doppel::app {

// Adds the verb; when it has run, `exit_code` is the program's.
void add_view(CLI::App& app, const RosArguments& ros, int& exit_code);

}  // namespace doppel::app
