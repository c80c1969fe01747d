#pragma once
// The first step of every verb over a description: TARGET and its name:=value arguments, as for `doppel up`,
// are resolved to a file and its packages; diagnostics are printed on stderr.

#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/scenario/resolve/open_target.h"

namespace CLI {
class App;
}

namespace doppel::app {

using DescriptionTarget = OpenedTarget;

// Adds TARGET and its arguments to a verb; `words`: the input of open_target.
void add_target(CLI::App& verb, std::vector<std::string>& words, bool required = true);

// Throws InputError: no such target, an argument that is not name:=value.
DescriptionTarget open_target(const std::vector<std::string>& words);

// A target that is a single word (`doppel diff A B`).
DescriptionTarget open_target(const std::string& target, XacroArguments arguments = {});

// The description with its overlay, as every command uses it. Warnings go to stderr.
LoadedDescription load_target(DescriptionTarget& target);

// "name:=value". Throws InputError.
std::pair<std::string, std::string> split_argument(const std::string& text);

// Warnings and errors to stderr, and notes if requested.
void print_diagnostics(const Diagnostics& diagnostics, bool notes = false,
                       std::size_t most_of_rule = kAllOfRule);

}  // namespace doppel::app
