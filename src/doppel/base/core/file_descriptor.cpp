#include "doppel/base/core/file_descriptor.h"

#include <unistd.h>

#include <cerrno>

namespace doppel {

FileDescriptor::~FileDescriptor() {
  if (is_open()) close(fd_);
}

ssize_t read_all(int fd, std::span<std::byte> out) {
  std::size_t done = 0;
  while (done < out.size()) {
    const ssize_t got = read(fd, out.data() + done, out.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return got;
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return static_cast<ssize_t>(done);
}

}  // namespace doppel
