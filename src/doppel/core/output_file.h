#pragma once
// Writing results: whole or not at all.

#include <filesystem>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

// Writes a file beside `file` and puts it in its place once it is whole on the disk, so that an old one stays
// if anything fails; the new one has the old one's permissions. Throws InputError "output.unwritable" with
// the system's reason.
DOPPEL_API void write_whole(const std::filesystem::path& file, std::string_view content);

}  // namespace doppel
