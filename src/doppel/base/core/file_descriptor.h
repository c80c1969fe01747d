#pragma once
// An open file descriptor, closed by the destructor.

#include <sys/types.h>

#include <cstddef>
#include <span>
#include <utility>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API FileDescriptor {
 public:
  // fd: the result of open(); negative: it has failed, and nothing is closed.
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor();
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;

  [[nodiscard]] bool is_open() const { return fd_ >= 0; }
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

// Reads until `out` is full or the file ends. Returns the number of bytes; negative: failed, with errno.
DOPPEL_API ssize_t read_all(int fd, std::span<std::byte> out);

}  // namespace doppel
