#pragma once
// The last half minute of a running twin, always: a recorder whose rolling files are in the folder of the
// announcements (in memory, with most systems), and which writes them out as a bag when something happens:
// the emergency stop, an error, a divergence, an episode at a limit, an alarm of the mirror, a request. Files
// of a process that was killed are written out by the next one. Topics of sensors are not in it, because
// sensors of light would be computed for it. A bag has the meshes and files of the run, so that it draws the
// robot by itself; with the journal of the run since its start (kJournalAttachment) it can be run again, as
// long as both are not too large. The parameters of all nodes are an attachment, too.

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "doppel/base/core/folder_lock.h"
#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/lab/recording/parameter_snapshot.h"
#include "doppel/lab/recording/run_files.h"
#include "doppel/lab/recording/run_journal.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/record/bus_recorder.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {

struct BlackBoxOptions {
  Duration length = std::chrono::seconds(30);     // what is written
  std::chrono::milliseconds afterwards{5000};     // of wall-clock time, before a cause is written
  std::filesystem::path scratch, folder;          // of the rolling files, and of the bags; both are made
  std::size_t max_bags = 20, max_snapshots = 10;  // the oldest ones of each are removed
  std::string version;                            // of doppel
  bool keeps_states = false;                      // Twin::keep_states(), which a rewind needs again
  // Time in which another twin chooses the name of a bag; a bag that waits longer is not written.
  std::chrono::milliseconds lock_timeout = FolderLock::kLockTimeout;
};
// scratch: that of the announcements; folder: $XDG_STATE_HOME/doppel/black_box, else
// ~/.local/state/doppel/black_box, empty without a home.
[[nodiscard]] DOPPEL_API BlackBoxOptions default_black_box();

class DOPPEL_API BlackBox {
 public:
  // The loop's thread, before the first step. Throws InputError: a folder cannot be made, or the scratch is
  // open to other users. Serves /doppel/snapshot (std_srvs/srv/Trigger), whose answer has the path of the
  // bag.
  BlackBox(Twin& twin, BlackBoxOptions options, const Log& log);
  ~BlackBox();
  BlackBox(const BlackBox&) = delete;
  BlackBox& operator=(const BlackBox&) = delete;

 private:
  using WallTime = std::chrono::steady_clock::time_point;
  struct Pending {
    std::string cause;
    WallTime due;
  };
  void look(const BagTopicCount& topic, const Edge::Incoming& message);  // the recorder's thread
  void notice(const std::string& cause);
  void write_due();
  // `done` gets the bag's folder, or the reason of a failure.
  using Done = std::function<void(const std::filesystem::path& bag, const std::string& failure)>;
  void write(const std::string& cause, const Done& done);
  void salvage();
  void copy_killed(const std::filesystem::path& rolling);
  void read_files(const RunSources& sources);
  void add_parts(const std::string& cause, BagWriter& bag, std::uint64_t time);
  void remove_old() const;

  Twin& twin_;
  const BlackBoxOptions options_;
  const Log& log_;
  const std::filesystem::path rolling_;
  std::mutex about_mutex_;
  std::vector<std::pair<std::string, std::string>> about_;  // the versions, and what is not recorded
  Node node_;
  // The recorder's thread.
  ParameterSnapshot parameters_;
  std::optional<RunJournal> journal_;  // from the first message on
  std::vector<Pending> pending_;
  std::map<std::string, bool> stopped_;  // by topic
  bool diverged_ = false;
  std::map<std::string, WallTime> noticed_;  // by the kind of the cause
  std::atomic<bool> ending_{false};
  std::optional<BusRecorder> recorder_;
  std::thread reader_;
};

}  // namespace doppel
