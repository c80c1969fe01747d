#include "doppel/base/mcap/mcap_file_sink.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <thread>

#include "doppel/base/core/diagnostic.h"

namespace doppel {

// Syncs whenever it was asked to since it last began to.
struct McapFileSink::Background {
  explicit Background(int file) : thread([this, file] { run(file); }) {}
  ~Background() {
    {
      const std::lock_guard lock(mutex);
      is_ending = true;
    }
    changed.notify_one();
    thread.join();
  }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  void start() {
    {
      const std::lock_guard lock(mutex);
      is_due = true;
    }
    changed.notify_one();
  }
  void run(int file) {
    std::unique_lock lock(mutex);
    while (true) {
      changed.wait(lock, [this] { return is_due || is_ending; });
      if (!is_due) return;
      is_due = false;
      lock.unlock();
      if (fsync(file) != 0) error = errno;
      lock.lock();
    }
  }

  std::mutex mutex;
  std::condition_variable changed;
  bool is_due = false, is_ending = false;
  std::atomic<int> error{0};  // errno
  std::thread thread;         // last: it uses the members above
};

McapFileSink::McapFileSink(const std::string& path)
    : path_(path), file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {
  if (!file_.is_open()) fail(errno);
}

McapFileSink::~McapFileSink() = default;

void McapFileSink::write(McapBytes bytes) {
  if (failed_ == 0 && background_ != nullptr) failed_ = background_->error.load();
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

void McapFileSink::start_sync() {
  if (background_ == nullptr) background_ = std::make_unique<Background>(file_.get());
  background_->start();
}

void McapFileSink::fail(int error) const {
  throw InputError("output.unwritable", {},
                   fmt::format("'{}' cannot be written: {}", path_, std::strerror(error)),
                   error == EEXIST ? "name another file, or remove this one" : "");
}

}  // namespace doppel
