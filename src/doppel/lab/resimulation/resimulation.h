#pragma once
// Runs a recorded run again: its scenario from the recorded files, and its inputs at their steps. The same
// build gives the same hashes; another scenario (an overlay, other arguments) is a what-if under the same
// inputs.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/lab/headless_run/headless_run.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/record/bag_reader.h"
#include "doppel/ros/record/bus_recorder.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

struct RecordedRun {
  Scenario scenario;             // of the files in the folder of read_recorded_run()
  std::filesystem::path folder;  // where these files are
  std::filesystem::path root;    // where the recorded run read them
  std::string version, engine;   // of doppel, and of the engine: "mujoco 2.3.3"
  std::vector<doppel_msgs::msg::Input> inputs;
  std::vector<doppel_msgs::msg::StateHash> hashes;  // by their steps
  bool keeps_states = false;                        // Twin::keep_states()
  std::uint64_t first_step = 1;                     // of which the recording has messages, about
  std::uint64_t lost_inputs = 0;                    // that the recorder has missed
  Diagnostics notes;                                // doppel's own files have changed since
};

// Also from a bag of the black box, whose journal (kJournalAttachment) begins with the run.
// `folder`: an empty one, for the run's files, which is kept as long as the run is used. Throws InputError
// "bag.no_run": the recording has no scenario, no inputs or no hashes, because it was not made by `up
// --record` or the black box; or it is of real hardware, which a run again must not move. The recording is
// data, of a stranger perhaps: it loads no code (`plugins`: of load_scenario()) and writes nothing outside
// of `folder`.
[[nodiscard]] DOPPEL_API RecordedRun read_recorded_run(BagReader& bag, const std::filesystem::path& folder,
                                                       const std::filesystem::path& bundled_robots,
                                                       const std::vector<std::string>& plugins = {});

struct ResimulationOptions {
  const std::atomic<bool>* cancel = nullptr;
  std::function<void(double)> progress = {};  // 0..1
  // Records the run, and is made for its twin before the first step.
  std::function<RecorderOptions(Twin&)> record = {};
  // Messages are compared with those of the recording, so that the first that differs is named.
  BagReader* compare_with = nullptr;
};

struct FirstDifference {
  std::uint64_t step = 0;
  std::string topic;  // empty: only the hash differs
  Time time{};
};

struct DOPPEL_API Resimulation {
  RunResult run;
  std::size_t compared = 0;                  // hashes
  std::optional<std::uint64_t> wrong_after;  // the first step whose hash differs, if one does
  std::uint64_t equal_until = 0;             // the last step whose hash is equal
  std::optional<FirstDifference> first;      // of the messages
  std::vector<std::string> failed_inputs;    // which could not be repeated, and why

  [[nodiscard]] bool equal() const {
    return run.end != RunEnd::failed && !wrong_after && compared > 0 && failed_inputs.empty();
  }
};

// Until the last recorded hash. Does not throw InputError: a run that cannot be started has failed
// (RunResult).
[[nodiscard]] DOPPEL_API Resimulation resimulate(const RecordedRun& run, const ResimulationOptions& options);

}  // namespace doppel
