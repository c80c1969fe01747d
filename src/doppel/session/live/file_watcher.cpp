#include "doppel/session/live/file_watcher.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

namespace doppel {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

constexpr std::uint32_t kSaved = IN_CLOSE_WRITE | IN_MOVED_TO | IN_DELETE | IN_MOVED_FROM;
constexpr std::uint32_t kMoved = IN_DELETE_SELF | IN_MOVE_SELF;  // of a folder
constexpr std::uint32_t kMade = IN_CREATE | IN_MOVED_TO;         // in it

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

void FileWatcher::add(const fs::path& file, const FileVersion& version) {
  files_.emplace(plain(file), version);
  std::error_code none;
  if (!fs::is_symlink(file, none)) return;
  const fs::path source = fs::canonical(file, none);  // of an installed link
  if (!none) files_.emplace(plain(source), version);
}

void FileWatcher::add_what_was_read() {
  if (read_ == nullptr) return;
  for (const auto& [file, version] : read_->take()) add(file, version);
}

void FileWatcher::watch(const std::vector<fs::path>& files) {
  const auto former = std::exchange(files_, {});
  add_what_was_read();
  for (const fs::path& file : files) add(file, FileVersion::of(file));
  // A file that was watched before keeps its version, so that a change since the last event is not lost.
  for (auto& [file, version] : files_) {
    if (const auto known = former.find(file); known != former.end()) version = known->second;
  }
  set_watches();
}

void FileWatcher::set_watches() {
  // A folder may be made while the watches are set: then those of a further round include it.
  constexpr int kMaxRounds = 5;
  for (int round = 0; round < kMaxRounds; ++round) {
    std::map<fs::path, std::uint32_t> wanted;
    awaited_.clear();
    std::error_code none;
    for (const auto& [file, version] : files_) {
      fs::path folder = file.parent_path();
      std::uint32_t events = kSaved;
      for (; !fs::is_directory(folder, none) && folder != folder.parent_path();
           folder = folder.parent_path()) {
        awaited_.insert(folder);
        events = kMade;
      }
      wanted[folder] |= events | kMoved;
      while (folder != folder.parent_path()) wanted[folder = folder.parent_path()] |= kMoved;
    }
    std::unordered_map<int, fs::path> watched;
    for (const auto& [folder, events] : wanted) {
      const int watch = inotify_add_watch(inotify_, folder.c_str(), events | IN_ONLYDIR);
      if (watch >= 0) watched[watch] = folder;
    }
    for (const auto& [watch, folder] : folders_) {
      if (!watched.contains(watch)) inotify_rm_watch(inotify_, watch);
    }
    folders_ = std::move(watched);
    if (std::ranges::none_of(awaited_,
                             [&](const fs::path& folder) { return fs::is_directory(folder, none); }))
      return;
  }
}

void FileWatcher::compare(std::set<fs::path>& changed) {
  for (auto& [file, version] : files_) {
    const FileVersion now = FileVersion::of(file);
    if (now == version) continue;
    version = now;
    changed.insert(file);
  }
}

void FileWatcher::renew(std::set<fs::path>& changed) {
  set_watches();
  compare(changed);
}

FileWatcher::Events FileWatcher::read_events(std::chrono::nanoseconds timeout, std::set<fs::path>& changed) {
  std::array<pollfd, 2> waited{pollfd{inotify_, POLLIN, 0}, pollfd{stop_, POLLIN, 0}};
  const timespec time{.tv_sec = timeout / std::chrono::seconds(1),
                      .tv_nsec = timeout % std::chrono::seconds(1) / std::chrono::nanoseconds(1)};
  const bool forever = timeout < std::chrono::nanoseconds(0);
  const int ready = ppoll(waited.data(), waited.size(), forever ? nullptr : &time, nullptr);
  if ((waited[1].revents & POLLIN) != 0) return Events::stopped;
  if (ready <= 0) return Events::none;
  alignas(inotify_event) std::array<char, 16384> buffer;
  const ssize_t size = read(inotify_, buffer.data(), buffer.size());
  std::set<fs::path> reported;
  bool is_outdated = false;
  for (ssize_t offset = 0; offset < size;) {
    inotify_event event;
    std::memcpy(&event, buffer.data() + offset, sizeof event);
    const auto folder = folders_.find(event.wd);
    // IN_IGNORED: the watch has ended, with its folder or its file system. A full queue has lost events.
    if ((event.mask & (IN_Q_OVERFLOW | kMoved | IN_UNMOUNT)) != 0) is_outdated = true;
    if ((event.mask & IN_IGNORED) != 0 && folder != folders_.end()) {
      folders_.erase(folder);
      is_outdated = true;
    } else if (folder != folders_.end() && event.len > 0) {
      const fs::path file = folder->second / (buffer.data() + offset + sizeof event);
      if (files_.contains(file)) reported.insert(file);
      is_outdated = is_outdated || awaited_.contains(file);
    }
    offset += static_cast<ssize_t>(sizeof event + event.len);
  }
  for (const fs::path& file : reported) files_[file] = FileVersion::of(file);
  changed.insert(reported.begin(), reported.end());
  if (is_outdated) renew(changed);
  return Events::some;
}

std::vector<fs::path> FileWatcher::wait(std::chrono::milliseconds quiet,
                                        std::optional<std::chrono::milliseconds> at_most) {
  std::set<fs::path> changed;
  const std::size_t before = files_.size();
  add_what_was_read();
  if (files_.size() != before) set_watches();
  compare(changed);  // since the last change was reported
  const auto give_up = steady_clock::now() + at_most.value_or(std::chrono::milliseconds(0));
  while (changed.empty()) {
    const std::chrono::nanoseconds left =
        at_most ? give_up - steady_clock::now() : std::chrono::nanoseconds(-1);
    if (at_most && left <= std::chrono::nanoseconds(0)) return {};
    if (read_events(left, changed) == Events::stopped) return {};
  }
  const auto latest = steady_clock::now() + kMaxWait;
  auto end = steady_clock::now() + quiet;
  for (auto now = steady_clock::now(); now < std::min(end, latest); now = steady_clock::now()) {
    std::set<fs::path> further;
    if (read_events(std::min(end, latest) - now, further) == Events::stopped) return {};
    if (!further.empty()) end = steady_clock::now() + quiet;
    changed.merge(further);
  }
  return {changed.begin(), changed.end()};
}

void FileWatcher::stop() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = write(stop_, &one, sizeof one);
}

}  // namespace doppel
