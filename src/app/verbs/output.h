#pragma once
// Where a verb's result goes: whole into a file, or to stdout.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace doppel::app {

// `file` empty or "-": stdout; a reader that leaves early (| head) is not a failure. Throws InputError where
// it cannot be written.
void deliver(std::string_view text, const std::string& file = "");

// Throws InputError where `file` is one of those that the result was made of, also by another name or a link.
void refuse_own_source(const std::string& file, std::span<const std::filesystem::path> sources,
                       const std::string& fix);

}  // namespace doppel::app
