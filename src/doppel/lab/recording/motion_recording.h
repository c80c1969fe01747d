#pragma once
// A short recording of a bus in memory, made on the loop's thread: the same steps give the same bytes, which
// depend on no wall-clock time and no disk.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/base/mcap/mcap_memory_sink.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/ros/record/bus_recorder.h"

namespace doppel {

struct MotionRecordingOptions {
  std::uint64_t max_bytes = 20'000'000;      // of the recording, after which it ends
  std::uint64_t max_mesh_bytes = 8'000'000;  // of the attached meshes together, within these
};

// One MCAP file in rosbag2's shape.
struct RecordedMotion {
  std::vector<std::byte> bytes;
  std::vector<std::string> notes;  // what is not in it, and why
};

class DOPPEL_API MotionRecording {
 public:
  // Records every topic but pictures, clouds and scans, from now on, with the meshes of the world attached,
  // so that a page draws it where their packages are not installed. The bus and the log outlive it.
  MotionRecording(Bus& bus, const CompiledWorld& world, const Log& log,
                  const MotionRecordingOptions& options = {});
  // After each step.
  void take();
  [[nodiscard]] RecordedMotion finish();

 private:
  MotionRecordingOptions options_;
  Bus& bus_;
  McapMemorySink sink_;
  std::vector<std::string> notes_;
  std::unique_ptr<BusRecorder> recorder_;  // nullptr: the recording has ended
};

}  // namespace doppel
