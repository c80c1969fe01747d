#pragma once
// The command line's own verbs and options, for completion and man pages.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace doppel::app {

// The verbs without the hidden ones, in the order of --help.
std::vector<const CLI::App*> verbs_of(const CLI::App& command);
std::vector<const CLI::Option*> options_of(const CLI::App& command);
std::vector<const CLI::Option*> positionals_of(const CLI::App& command);
// True if a word follows it on the command line.
bool takes_value(const CLI::Option& option);

}  // namespace doppel::app
