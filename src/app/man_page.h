#pragma once
// `doppel man`: manual pages, made from the same verbs, options and examples as --help; the pages of the
// documentation; and what an error means.

namespace CLI {
class App;
}

namespace doppel::app {

void add_man(CLI::App& app, int& exit_code);

}  // namespace doppel::app
