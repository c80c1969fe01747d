#include "doppel/base/core/file_version.h"

#include <sys/stat.h>

namespace doppel {

FileVersion FileVersion::of(const std::filesystem::path& file) {
  struct stat found {};
  if (stat(file.c_str(), &found) != 0) return {};
  return {.modified_ns = found.st_mtim.tv_sec * std::int64_t{1'000'000'000} + found.st_mtim.tv_nsec,
          .inode = found.st_ino,
          .size = static_cast<std::uint64_t>(found.st_size)};
}

}  // namespace doppel
