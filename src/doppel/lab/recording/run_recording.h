#pragma once
// Records a run from its first step on, with all that lets it be run again.

#include <cstdint>
#include <string>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/record/bus_recorder.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {

struct RunRecordingOptions {
  BagWriterOptions bag;
  TopicSelection topics = {.all = true};
  std::string version = {};   // of doppel
  bool keeps_states = false;  // Twin::keep_states(), which a rewind needs again
  std::uint64_t max_mesh_bytes = std::uint64_t{200} << 20U;  // of attached meshes; 0: none
};

// The options of a recorder of this twin: its scenario, files, meshes and versions. Services publish their
// calls from now on, unless their introspection is chosen by a parameter. The loop's thread, before the
// first step.
[[nodiscard]] DOPPEL_API RecorderOptions run_recorder_options(Twin& twin, RunRecordingOptions options,
                                                              const Log& log);

// A folder's name that does not exist yet, as ros2 bag chooses it: "rosbag2_2026_11_27-21_05_30" in `parent`.
[[nodiscard]] DOPPEL_API std::filesystem::path dated_bag_folder(const std::filesystem::path& parent);

}  // namespace doppel
