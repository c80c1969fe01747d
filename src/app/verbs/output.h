#pragma once
// Where a verb's result goes: whole into a file, or to stdout.

#include <string>
#include <string_view>

namespace doppel::app {

// `file` empty or "-": stdout; a reader that leaves early (| head) is no failure. Throws InputError where it
// cannot be written.
void deliver(std::string_view text, const std::string& file = "");

}  // namespace doppel::app
