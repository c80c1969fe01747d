#include "doppel/base/mcap/mcap_file_sink.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "doppel/base/core/diagnostic.h"

namespace doppel {

McapFileSink::McapFileSink(const std::string& path)
    : path_(path), file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {
  if (!file_.is_open()) fail(errno);
}

void McapFileSink::write(McapBytes bytes) {
  if (failed_ != 0) fail(failed_);  // a later record would leave a hole
  const std::uint64_t whole = size_;
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      failed_ = errno;
      // The file ends with its last whole record.
      static_cast<void>(ftruncate(file_.get(), static_cast<off_t>(whole)) == 0);
      fail(failed_);
    }
    size_ += static_cast<std::uint64_t>(written);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

void McapFileSink::sync() {
  if (fsync(file_.get()) != 0) fail(errno);
}

void McapFileSink::fail(int error) const {
  throw InputError("output.unwritable", {},
                   fmt::format("'{}' cannot be written: {}", path_, std::strerror(error)),
                   error == EEXIST ? "name another file, or remove this one" : "");
}

}  // namespace doppel
