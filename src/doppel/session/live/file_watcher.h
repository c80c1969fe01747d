#pragma once
// Reports changes of a set of files. Folders are watched instead of files, because editors replace a file by
// a new one; and the folders above them, because a folder may be removed and made again, or be a link that
// gets another target. The kernel watches folders themselves and not their names, so the watches are renewed
// whenever one of these folders or links is moved, removed or made.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "doppel/base/core/files_read.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API FileWatcher {
 public:
  FileWatcher();
  ~FileWatcher();
  FileWatcher(const FileWatcher&) = delete;
  FileWatcher& operator=(const FileWatcher&) = delete;

  [[nodiscard]] bool works() const { return inotify_ >= 0; }
  // Replaces the set of watched files. Files and their folders may not exist yet.
  void watch(const std::vector<std::filesystem::path>& files);
  // Also watches the files that are recorded there, from the next wait() on.
  void watch_read(std::shared_ptr<FilesRead> files) { read_ = std::move(files); }
  // Waits for a change and then until none of the files changes for `quiet`, because an editor may write
  // several times; at most kMaxWait after the first change. Empty: stop() was called, or nothing has
  // changed in the time `at_most`.
  std::vector<std::filesystem::path> wait(std::chrono::milliseconds quiet,
                                          std::optional<std::chrono::milliseconds> at_most = std::nullopt);
  void stop();  // from any thread
  static constexpr std::chrono::milliseconds kMaxWait{250};

 private:
  enum class Events : std::uint8_t { stopped, none, some };

  // Adds the changes that the kernel reports within the time to `changed`.
  Events read_events(std::chrono::nanoseconds timeout, std::set<std::filesystem::path>& changed);
  // Watches the folders as they are now, and adds the files that differ from their known version.
  void renew(std::set<std::filesystem::path>& changed);
  void set_watches();
  void compare(std::set<std::filesystem::path>& changed);

  void follow(const std::filesystem::path& file, std::map<std::filesystem::path, std::uint32_t>& events);
  void add_what_was_read();

  int inotify_ = -1, stop_ = -1;
  std::shared_ptr<FilesRead> read_;
  std::unordered_map<int, std::filesystem::path> folders_;  // by watch
  // The files as they were named, with the version that was reported last.
  std::map<std::filesystem::path, FileVersion> files_;
  // Entries of the watched folders: the files themselves, links on the way, folders that do not exist yet.
  std::map<std::filesystem::path, std::set<std::filesystem::path>> saved_;
  std::set<std::filesystem::path> links_, awaited_;
};

}  // namespace doppel
