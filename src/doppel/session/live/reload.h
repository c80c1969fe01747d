#pragma once
// Reload on save: watches the files of a running twin or view, builds a new machine from the changed files
// while the old one is running, and replaces it between two steps. An invalid edit is reported, and the old
// machine keeps running.

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "doppel/base/core/abandoned_thread.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/files_read.h"
#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/session/live/file_watcher.h"
#include "doppel/twin/assembly/twin.h"
#include "doppel/twin/viewer/viewer.h"

namespace doppel {

// The three stages of a replacement: begin() on the loop's thread records the running machine; its result
// builds the new one on any thread; that result replaces the machine on the loop's thread and returns a text
// about the joints. The latter two throw InputError.
struct Reloadable {
  using TakeOver = std::function<std::string()>;
  using Build = std::function<TakeOver(Diagnostics&)>;
  Bus& bus;
  std::function<std::vector<std::filesystem::path>()> files;  // to watch; the loop's thread
  std::function<Build()> begin;
  std::function<void()> afterwards;                 // after an accepted or rejected edit; the loop's thread
  std::shared_ptr<FilesRead> files_read = nullptr;  // by builds: watched, too
};
// before: called with a replacement that may still be rejected; the loop's thread.
DOPPEL_API Reloadable reloadable(Twin& twin, std::function<void(const Twin::Replacement&)> before,
                                 std::function<void()> afterwards);
DOPPEL_API Reloadable reloadable(Viewer& viewer, std::function<void(const Viewer::Replacement&)> before,
                                 std::function<void()> afterwards);

class DOPPEL_API Reloader {
 public:
  // On the loop's thread. The loop must keep running while this object exists, or destroy it itself.
  Reloader(Reloadable what, const Log& log);
  ~Reloader();
  Reloader(const Reloader&) = delete;
  Reloader& operator=(const Reloader&) = delete;

 private:
  // A build of the present files, which may never end: a mesh of a billion triangles, a folder on a network
  // that is gone, a physics engine in an endless loop.
  struct Attempt;
  void run();
  // Starts a build of the present files; `changed` is for messages, and empty repeats the present attempt.
  void begin_attempt(std::vector<std::filesystem::path> changed);
  // True: the attempt has ended, and its machine runs or was refused.
  bool finish_attempt();
  void abandon_attempt();
  void take_over();
  void report_refusal();
  // Runs `task` on the loop's thread and waits for it; false: the program ends.
  bool on_loop(const std::function<void()>& task);

  Reloadable what_;
  const Log& log_;
  FileWatcher watcher_;
  std::atomic<bool> ending_{false};
  std::unique_ptr<Attempt> attempt_;  // by `builds_`, on the thread of run(); nullptr: none is under way
  AbandonableWork builds_;
  std::thread thread_;
};

}  // namespace doppel
