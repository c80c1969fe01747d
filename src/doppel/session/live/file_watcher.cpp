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

// In a folder. IN_CREATE alone reports a file or link that is made whole, by link() or symlink().
constexpr std::uint32_t kNamed = IN_CREATE | IN_DELETE | IN_MOVED_FROM | IN_MOVED_TO;
constexpr std::uint32_t kSaved = kNamed | IN_CLOSE_WRITE;
constexpr std::uint32_t kMoved = IN_DELETE_SELF | IN_MOVE_SELF;  // a folder itself

fs::path absolute_path(const fs::path& file) {
  std::error_code failed;
  fs::path out = fs::absolute(file, failed);
  return failed ? file : out;
}

// A file that has just been created to be written; its end is reported by IN_CLOSE_WRITE.
bool is_empty_file(const fs::path& file) {
  std::error_code failed;
  return fs::file_size(file, failed) == 0 && !failed;
}

}  // namespace

FileWatcher::FileWatcher()
    : inotify_(inotify_init1(IN_CLOEXEC | IN_NONBLOCK)), stop_(eventfd(0, EFD_CLOEXEC)) {}

FileWatcher::~FileWatcher() {
  if (inotify_ >= 0) close(inotify_);
  if (stop_ >= 0) close(stop_);
}

void FileWatcher::add_what_was_read() {
  if (read_ == nullptr) return;
  for (const auto& [file, version] : read_->take()) files_.emplace(absolute_path(file), version);
}

void FileWatcher::watch(const std::vector<fs::path>& files) {
  const auto former = std::exchange(files_, {});
  add_what_was_read();
  for (const fs::path& file : files) files_.emplace(absolute_path(file), FileVersion::of(file));
  // A file that was watched before keeps its version, so that a change since the last event is not lost.
  for (auto& [file, version] : files_) {
    if (const auto known = former.find(file); known != former.end()) version = known->second;
  }
  set_watches();
}

// Follows the path of a file as the kernel does, so that the folder of each link on the way is watched, too:
// the link may get another target.
void FileWatcher::follow(const fs::path& file, std::map<fs::path, std::uint32_t>& events) {
  constexpr int kMaxLinks = 40;  // as in Linux
  int links = 0;
  fs::path folder = "/";
  std::vector<fs::path> rest;  // from the last part of the path to the next one
  const auto prepend = [&](const fs::path& path) {
    const std::vector<fs::path> parts(path.begin(), path.end());
    rest.insert(rest.end(), parts.rbegin(), parts.rend());
  };
  prepend(file);
  std::error_code none;
  while (!rest.empty()) {
    const fs::path part = std::exchange(rest.back(), {});
    rest.pop_back();
    if (part == "/") folder = part;
    if (part == "..") folder = folder.parent_path();
    if (part.empty() || part == "/" || part == "." || part == "..") continue;
    const fs::path entry = folder / part;
    events[folder] |= kMoved;
    if (fs::is_symlink(entry, none) && ++links <= kMaxLinks) {
      events[folder] |= kNamed;
      links_.insert(entry);
      prepend(fs::read_symlink(entry, none));
    } else if (rest.empty()) {
      events[folder] |= kSaved;
      saved_[entry].insert(file);
    } else if (fs::is_directory(entry, none)) {
      folder = entry;
    } else {
      events[folder] |= kNamed;
      awaited_.insert(entry);
      return;
    }
  }
}

void FileWatcher::set_watches() {
  // A folder may be made while the watches are set: then those of a further round include it.
  constexpr int kMaxRounds = 5;
  std::error_code none;
  for (int round = 0; round < kMaxRounds; ++round) {
    std::map<fs::path, std::uint32_t> events;
    awaited_.clear();
    links_.clear();
    saved_.clear();
    for (const auto& [file, version] : files_) follow(file, events);
    std::unordered_map<int, fs::path> watched;
    for (const auto& [folder, reported] : events) {
      const int watch = inotify_add_watch(inotify_, folder.c_str(), reported | IN_ONLYDIR);
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
      const fs::path entry = folder->second / (buffer.data() + offset + sizeof event);
      if (links_.contains(entry) || awaited_.contains(entry)) is_outdated = true;
      if (const auto saved = saved_.find(entry); saved != saved_.end()) {
        std::error_code none;
        if (fs::is_symlink(entry, none))
          is_outdated = true;
        else if ((event.mask & IN_CREATE) == 0 || !is_empty_file(entry))
          reported.insert(saved->second.begin(), saved->second.end());
      }
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
