#pragma once
// The pipes that read_content() reads besides regular files: those that the command line names, /dev/stdin or
// /dev/fd/63 as bash gives it for <(command). In a file of others the same name would wait for the input of
// this process without end.

#include <filesystem>
#include <span>
#include <string>

#include "doppel/export.h"

namespace doppel {

// Called before there are threads.
DOPPEL_API void allow_pipes(std::span<const std::string> arguments);
[[nodiscard]] DOPPEL_API bool is_allowed_pipe(const std::filesystem::path& file);

}  // namespace doppel
