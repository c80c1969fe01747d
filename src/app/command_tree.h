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
// Names that stand for two arguments of one verb, hidden ones included, as "bag record: topics": a positional
// and a long option of one name, or an option and a positional of the group above it. CLI11 2.1 accepts them,
// 2.4 refuses the whole command line at the start of the program.
std::vector<std::string> shared_names(const CLI::App& command);

}  // namespace doppel::app
