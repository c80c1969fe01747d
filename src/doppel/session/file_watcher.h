#pragma once
// Reports changes of a set of files. Folders are watched instead of files, because editors replace a file by
// a new one.

#include <chrono>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API FileWatcher {
 public:
  FileWatcher();
  ~FileWatcher();
  FileWatcher(const FileWatcher&) = delete;
  FileWatcher& operator=(const FileWatcher&) = delete;

  [[nodiscard]] bool works() const { return inotify_ >= 0; }
  // Replaces the set of watched files. Files may not exist yet.
  void watch(const std::vector<std::filesystem::path>& files);
  // Waits for a change and then until nothing more changes for `quiet`, because an editor may write several
  // times. Empty: stop() was called, or nothing has changed in the time `at_most`.
  std::vector<std::filesystem::path> wait(std::chrono::milliseconds quiet,
                                          std::optional<std::chrono::milliseconds> at_most = std::nullopt);
  void stop();  // from any thread

 private:
  // Adds the changes that the kernel reports to `changed`; false: none within the timeout, or stop().
  bool read_events(int timeout_ms, std::set<std::filesystem::path>& changed);

  int inotify_ = -1, stop_ = -1;
  std::unordered_map<int, std::filesystem::path> folders_;  // by watch
  std::set<std::filesystem::path> files_;
};

}  // namespace doppel
