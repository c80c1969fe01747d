#pragma once
// The check for sources that are newer than the program, which is then rebuilt before it starts.

#include <string>

namespace doppel::app {

// The checked files: all, or only those of the verb xacro, so that other edits do not delay it.
enum class Part { all, xacro };

// True where anything that tools/watched_sources listed for the last build (build/.doppel-built: "SECONDS
// PATH" a line) has another time of change now, earlier or later, or is gone; where there is no such list;
// and where the program is not there. One system call for each, and nothing else: it is part of every start.
bool must_build(const std::string& root, Part part);

// Runs tools/build, whose output goes to stderr. Its exit code.
int build(const std::string& root);

}  // namespace doppel::app
