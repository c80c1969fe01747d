#pragma once
// Distinguishes the versions of a file without reading it.

#include <cstdint>
#include <filesystem>

#include "doppel/export.h"

namespace doppel {

// All zero: there is no file.
struct DOPPEL_API FileVersion {
  std::int64_t modified_ns = 0;  // since 1970
  std::uint64_t inode = 0, size = 0;
  bool operator==(const FileVersion&) const = default;

  // The version of the file that is there now. Links are followed.
  static FileVersion of(const std::filesystem::path& file);
};

}  // namespace doppel
