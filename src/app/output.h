#pragma once
// The output of a verb's result: completely into a file, or to stdout.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace doppel::app {

// `file` empty or "-": stdout; a reader that closes early (| head) is not a failure. Throws InputError where
// it cannot be written.
void deliver(std::string_view text, const std::string& file = "");

// Throws InputError where deliver() will not be able to write `file`: before work that takes long.
void check_output(const std::string& file);

// Throws InputError where `file` is one of the sources of the result, also by another name or a link.
void refuse_own_source(const std::string& file, std::span<const std::filesystem::path> sources,
                       const std::string& fix);

}  // namespace doppel::app
