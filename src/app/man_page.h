#pragma once
// `doppel man`: manual pages, made from the same verbs, options and examples as --help; the pages of the
// documentation; and what an error means.

#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"

namespace CLI {
class App;
}

namespace doppel::app {

// The pages of the documentation, as `doppel man` takes them.
std::vector<std::string> document_names();

void add_man(CLI::App& app, int& exit_code);

// "  help: doppel man server.port_taken" for the first of the errors that the page troubleshooting.md
// explains; "": none.
std::string help_line(const InputError& error);

}  // namespace doppel::app
