#pragma once
// Reads files that others wrote: regular files only, and at most a number of bytes. A package may have a
// pipe, which waits without end, or a link to a device, which has no end, in place of each of its files.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/export.h"

namespace doppel {

struct RegularFile {
  FileDescriptor descriptor{-1};
  std::uint64_t size = 0;
  std::string problem;  // why it is not open: "it is not a regular file"; empty: it is open
  bool is_missing = false;
};
// Opens a file to read it. Devices are not opened: some of them act on that.
DOPPEL_API RegularFile open_regular_file(const std::filesystem::path& file);

struct DOPPEL_API FileContent {
  std::string bytes;
  std::string problem;  // as that of RegularFile, also that the file is too large; empty: it was read
  bool is_missing = false;

  [[nodiscard]] bool was_read() const { return problem.empty(); }
};
DOPPEL_API FileContent read_content(const std::filesystem::path& file, std::size_t max_bytes);
// The first bytes of a regular file, at most that many; empty: it cannot be read.
DOPPEL_API std::string beginning_of_file(const std::filesystem::path& file, std::size_t max_bytes);

// The content of a file, which is noted in FilesRead. Throws InputError "file.unreadable" with its name and
// the reason.
DOPPEL_API std::string read_file(const std::string& file, std::size_t max_bytes);

}  // namespace doppel
