#pragma once
// Paths in messages: relative to the working directory for files below it.

#include <filesystem>
#include <string>

#include "doppel/export.h"

namespace doppel {

// `file` relative to `folder` if it is below it, else unchanged; never relative to the root of
// the file system.
DOPPEL_API std::string shown_path(const std::filesystem::path& file, const std::filesystem::path& folder);

// The same for the working directory.
DOPPEL_API std::string shown_path(const std::filesystem::path& file);

}  // namespace doppel
