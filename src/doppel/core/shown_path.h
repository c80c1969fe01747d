#pragma once
// As people see files: relative to the folder that they work in, where they lie below it.

#include <filesystem>
#include <string>

#include "doppel/export.h"

namespace doppel {

// `file` relative to `folder` where it lies below it, else as it is; the root of the file system shortens
// nothing.
DOPPEL_API std::string shown_path(const std::filesystem::path& file, const std::filesystem::path& folder);

// By the working folder.
DOPPEL_API std::string shown_path(const std::filesystem::path& file);

}  // namespace doppel
