#pragma once
// Hot reload: watches the files that a running twin was made of, builds what they say now beside it, and lets
// that take over between two steps. What cannot be used is reported, and the old machine runs on.

#include <atomic>
#include <functional>
#include <thread>

#include "app/file_watcher.h"
#include "doppel/core/log.h"
#include "doppel/twin/twin.h"

namespace doppel::app {

class Reloader {
 public:
  // The twin's loop has to run while this lives. `replaced` is called on it after each reload.
  Reloader(Twin& twin, const Log& log, std::function<void()> replaced);
  ~Reloader();
  Reloader(const Reloader&) = delete;
  Reloader& operator=(const Reloader&) = delete;

  [[nodiscard]] std::size_t watched_files() const { return watched_; }

 private:
  void run();
  void reload(const std::vector<std::filesystem::path>& changed);
  // Runs `task` on the loop's thread and waits for it; false: the program ends.
  bool on_loop(const std::function<void()>& task);

  Twin& twin_;
  const Log& log_;
  std::function<void()> replaced_;
  FileWatcher watcher_;
  std::size_t watched_ = 0;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace doppel::app
