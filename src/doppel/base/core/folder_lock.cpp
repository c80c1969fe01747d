#include "doppel/base/core/folder_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <cerrno>
#include <thread>

#include "doppel/base/core/diagnostic.h"

namespace doppel {

FolderLock::FolderLock(const std::filesystem::path& folder, std::chrono::milliseconds lock_timeout)
    : folder_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kLook{5};  // flock() by itself has no timeout.
  const Clock::time_point end = Clock::now() + lock_timeout;
  while (folder_.is_open() && flock(folder_.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno == EINTR) continue;
    if (errno != EWOULDBLOCK) return;
    if (Clock::now() >= end) {
      const double seconds = std::chrono::duration<double>(lock_timeout).count();
      throw InputError(
          "folder.locked", {},
          fmt::format("another process keeps the folder '{}' locked for {:g} s", folder.string(), seconds),
          fmt::format("a twin that was stopped, as by Ctrl-Z, has it: let it go on (fg) or end it; "
                      "fuser -v '{}' names it",
                      folder.string()));
    }
    std::this_thread::sleep_for(kLook);
  }
}

}  // namespace doppel
