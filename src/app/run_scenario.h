#pragma once
// The scenario of `up` as a file: one that is started, and one that is written.

#include <optional>
#include <string>
#include <vector>

#include "doppel/scenario/schema/scenario_file.h"
#include "doppel/twin/assembly/twin.h"

namespace CLI {
class App;
}

namespace doppel::app {

// The scenario file that is the only word of the command line, with notes about files that have changed since
// it was written; nullopt: the words name something else. Throws InputError: an invalid file, or an option of
// `verb` or ROS arguments beside it that would change the scenario. plugins: of load_scenario().
std::optional<Scenario> given_scenario(const std::vector<std::string>& words, const CLI::App& verb,
                                       const RosArguments& ros, const std::vector<std::string>& plugins,
                                       Diagnostics& diagnostics);

// --write-scenario.
void add_write_scenario(CLI::App& verb, std::string& file);
// Writes the scenario of a twin with every choice that was made for it; "-": stdout. Throws InputError.
void write_scenario(const Twin& twin, const std::string& file);

// "5b0e2c... of 12 files": the hash of what the twin reads.
std::string content_hash_text(const Twin& twin, const std::string& scenario_file);

}  // namespace doppel::app
