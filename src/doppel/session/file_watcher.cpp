#include "doppel/session/file_watcher.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cstring>

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kSaved = IN_CLOSE_WRITE | IN_MOVED_TO | IN_DELETE | IN_MOVED_FROM;

fs::path plain(const fs::path& file) {
  std::error_code none;
  const fs::path whole = fs::absolute(file, none).lexically_normal();
  const fs::path folder = fs::weakly_canonical(whole.parent_path(), none);
  return none ? whole : folder / whole.filename();
}

}  // namespace

FileWatcher::FileWatcher()
    : inotify_(inotify_init1(IN_CLOEXEC | IN_NONBLOCK)), stop_(eventfd(0, EFD_CLOEXEC)) {}

FileWatcher::~FileWatcher() {
  if (inotify_ >= 0) close(inotify_);
  if (stop_ >= 0) close(stop_);
}

void FileWatcher::watch(const std::vector<fs::path>& files) {
  std::set<fs::path> wanted;
  files_.clear();
  const auto add = [&](const fs::path& file) {
    files_.insert(file);
    wanted.insert(file.parent_path());
  };
  for (const fs::path& file : files) {
    add(plain(file));
    std::error_code none;
    if (fs::is_symlink(file, none)) add(plain(fs::canonical(file, none)));  // an installed link to the source
  }
  std::erase_if(folders_, [&](const auto& entry) {
    if (wanted.erase(entry.second) > 0) return false;
    inotify_rm_watch(inotify_, entry.first);
    return true;
  });
  for (const fs::path& folder : wanted) {
    const int watch = inotify_add_watch(inotify_, folder.c_str(), kSaved);
    if (watch >= 0) folders_[watch] = folder;
  }
}

bool FileWatcher::read_events(int timeout_ms, std::set<fs::path>& changed) {
  std::array<pollfd, 2> waited{pollfd{inotify_, POLLIN, 0}, pollfd{stop_, POLLIN, 0}};
  if (poll(waited.data(), waited.size(), timeout_ms) <= 0 || (waited[1].revents & POLLIN) != 0) return false;
  alignas(inotify_event) std::array<char, 16384> buffer;
  const ssize_t size = read(inotify_, buffer.data(), buffer.size());
  for (ssize_t at = 0; at < size;) {
    inotify_event event;
    std::memcpy(&event, buffer.data() + at, sizeof event);
    const auto folder = folders_.find(event.wd);
    if (folder != folders_.end() && event.len > 0) {
      const fs::path file = folder->second / (buffer.data() + at + sizeof event);
      if (files_.contains(file)) changed.insert(file);
    }
    at += static_cast<ssize_t>(sizeof event + event.len);
  }
  return true;
}

std::vector<fs::path> FileWatcher::wait(std::chrono::milliseconds quiet,
                                        std::optional<std::chrono::milliseconds> at_most) {
  const int timeout = at_most ? static_cast<int>(at_most->count()) : -1;
  std::set<fs::path> changed;
  while (changed.empty()) {
    if (!read_events(timeout, changed)) return {};
  }
  while (read_events(static_cast<int>(quiet.count()), changed)) {
  }
  return {changed.begin(), changed.end()};
}

void FileWatcher::stop() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(stop_, &one, sizeof one);
}

}  // namespace doppel
