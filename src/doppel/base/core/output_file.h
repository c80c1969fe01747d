#pragma once
// Writing results completely or not at all.

#include <filesystem>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

// Writes a temporary file next to `file` and renames it once it is complete on the disk, so that an existing
// file stays if anything fails, and nothing else stays of a process that is killed; the new file has the permissions of
// the existing one. Throws InputError "output.unwritable" with the system's reason.
DOPPEL_API void write_whole(const std::filesystem::path& file, std::string_view content);

// Throws what write_whole() throws where no file can be written, before the content is made: `file` is a folder, or its
// folder does not exist or cannot be written to.
DOPPEL_API void check_writable(const std::filesystem::path& file);

// Writes all of the text to what is open. False: failed, with errno; a part of it may have been written.
[[nodiscard]] DOPPEL_API bool write_all(int fd, std::string_view text);

}  // namespace doppel
