#pragma once
// The texts that the program prints about itself: the short help, that of a verb, and errors of the command
// line.

#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace doppel::app {

// The verbs of the first day, and where the others are.
std::string short_help(const CLI::App& app);
// doppel help [VERB ...]: the short help, that of a verb, or with --all that of the program.
void add_help(CLI::App& app, int& exit_code);
// Prints the error with the nearest verb or option, and returns the exit code.
int report_usage(const CLI::App& app, const CLI::ParseError& error);

}  // namespace doppel::app
