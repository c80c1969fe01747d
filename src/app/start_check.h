#pragma once
// The check for sources that are newer than the program, which is then rebuilt before it starts.

#include <string>
#include <string_view>

namespace doppel::app {

// The part that has to be up to date for a verb: the twin of up and view; the program with all verbs; or
// only the files of the verb xacro, so that other edits do not delay it.
enum class Part { twin, all, xacro };

// The part that a verb needs.
Part part_for(std::string_view verb);

// True where anything that tools/watched_sources listed for the last build of the part (build/.twin-built or
// build/.doppel-built: "SECONDS PATH" a line) has another time of change now, earlier or later, or is gone;
// where there is no such list; and where the program is not there. One system call for each, and nothing
// else: it is part of every start.
bool must_build(const std::string& root, Part part);

// Runs tools/build for the part, whose output goes to stderr. Its exit code.
int build(const std::string& root, Part part);

}  // namespace doppel::app
