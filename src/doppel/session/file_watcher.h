#pragma once
// Tells when one of a set of files was saved. Folders are watched rather than files, because editors put a
// new file in the old one's place.

#include <chrono>
#include <filesystem>
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
  // In place of what was watched before. Files may be missing; they are waited for.
  void watch(const std::vector<std::filesystem::path>& files);
  // Waits for a change and then until nothing more changes for `quiet` (an editor writes in several strokes).
  // Empty: stop() was called.
  std::vector<std::filesystem::path> wait(std::chrono::milliseconds quiet);
  void stop();  // from any thread

 private:
  // Adds what the kernel told to `changed`; false: nothing came in time, or stop().
  bool read_events(int timeout_ms, std::set<std::filesystem::path>& changed);

  int inotify_ = -1, stop_ = -1;
  std::unordered_map<int, std::filesystem::path> folders_;  // by watch
  std::set<std::filesystem::path> files_;
};

}  // namespace doppel
