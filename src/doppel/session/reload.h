#pragma once
// Hot reload: watches the files that a running twin or view was made of, builds what they say now beside it,
// and lets that take over between two steps. What cannot be used is reported, and the old machine keeps
// running.

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/core/diagnostic.h"
#include "doppel/core/log.h"
#include "doppel/export.h"
#include "doppel/session/file_watcher.h"
#include "doppel/twin/twin.h"
#include "doppel/twin/viewer.h"

namespace doppel {

// How something that runs is recreated, in three turns: begin() on the loop's thread notes what is to go on,
// the result builds beside it on any thread, and that result takes over on the loop's thread and says what
// became of the joints. The latter two throw InputError.
struct Reloadable {
  using TakeOver = std::function<std::string()>;
  using Build = std::function<TakeOver(Diagnostics&)>;
  Bus& bus;
  std::function<std::vector<std::filesystem::path>()> files;  // to watch; the loop's thread
  std::function<Build()> begin;
  std::function<void()> afterwards;  // after an edit, taken or refused; the loop's thread
};
// before: what is about to take over, and may be refused yet; the loop's thread.
DOPPEL_API Reloadable reloadable(Twin& twin, std::function<void(const Twin::Replacement&)> before,
                                 std::function<void()> afterwards);
DOPPEL_API Reloadable reloadable(Viewer& viewer, std::function<void(const Viewer::Replacement&)> before,
                                 std::function<void()> afterwards);

class DOPPEL_API Reloader {
 public:
  // On the loop's thread. The loop has to keep running while this lives, or to be what ends it.
  Reloader(Reloadable what, const Log& log);
  ~Reloader();
  Reloader(const Reloader&) = delete;
  Reloader& operator=(const Reloader&) = delete;

 private:
  void run();
  void reload(const std::vector<std::filesystem::path>& changed);
  // Replaces the machine by one from the current files. False: the program ends. Throws InputError.
  bool apply(std::string& outcome, Diagnostics& said);
  // Runs `task` on the loop's thread and waits for it; false: the program ends.
  bool on_loop(const std::function<void()>& task);

  Reloadable what_;
  const Log& log_;
  FileWatcher watcher_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace doppel
