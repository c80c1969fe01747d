#pragma once

#include <filesystem>
#include <span>

#include "doppel/description/scaffold/arm_package.h"
#include "doppel/export.h"

namespace doppel::scaffold {

// Writes a new folder `folder` with the files, completely or not at all. Throws InputError if the path exists
// or cannot be written.
DOPPEL_API void write_package(const std::filesystem::path& folder, std::span<const PackageFile> files);

}  // namespace doppel::scaffold
