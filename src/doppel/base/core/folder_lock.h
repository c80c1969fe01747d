#pragma once
// A lock between processes of one user: who works on the files of a folder, one after another.

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <filesystem>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/export.h"

namespace doppel {

// Waits for the lock. A folder that cannot be opened is not locked.
class DOPPEL_API FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder)
      : folder_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    while (folder_.is_open() && flock(folder_.get(), LOCK_EX) != 0 && errno == EINTR) continue;
  }

 private:
  FileDescriptor folder_;
};

}  // namespace doppel
