#pragma once
// The pages of the documentation in docs/, for `doppel man` and for the help behind an error.

#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"

namespace doppel::app {

// The pages' names: "worlds.md", "tutorials/kate.md".
std::vector<std::string> document_names();

// The page of a name ("worlds", "worlds.md", "docs/worlds.md" and, of a tutorial, "kate"), or the section of
// troubleshooting.md that explains the rule of a name ("server.port_taken"). Empty: there is neither.
std::string document_text(const std::string& name);

// "  help: doppel man server.port_taken" for the first of the errors that the page troubleshooting.md
// explains; "": none.
std::string help_line(const InputError& error);

}  // namespace doppel::app
