#pragma once
// `doppel completion`: scripts for bash, zsh and fish, and the candidates that they request.

namespace CLI {
class App;
}

namespace doppel::app {

void add_completion(CLI::App& app, int& exit_code);

}  // namespace doppel::app
