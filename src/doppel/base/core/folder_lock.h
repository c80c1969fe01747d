#pragma once
// A lock between processes of one user: who works on the files of a folder, one after another.

#include <chrono>
#include <filesystem>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/export.h"

namespace doppel {

// Held while it lives. A folder that cannot be opened, or whose file system has no locks, is not locked.
class DOPPEL_API FolderLock {
 public:
  // Far longer than any of its holders works. One that was stopped (Ctrl-Z, a debugger) has it for as long as
  // it stands still, and must not stop all others.
  static constexpr std::chrono::milliseconds kLockTimeout{3000};

  // Throws InputError "folder.locked" where another process has the lock for longer than `lock_timeout`.
  explicit FolderLock(const std::filesystem::path& folder,
                      std::chrono::milliseconds lock_timeout = kLockTimeout);

 private:
  FileDescriptor folder_;
};

}  // namespace doppel
