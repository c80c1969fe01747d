#include "doppel/lab/recording/motion_recording.h"

#include <fmt/format.h>

#include "doppel/lab/recording/run_files.h"
#include "doppel/ros/messages/distro.h"
#include "doppel/twin/journal/input_journal.h"

namespace doppel {
namespace {

constexpr std::size_t kRing = std::size_t{16} << 20U;  // of one step
constexpr std::uint64_t kMegabyte = 1'000'000;

// They would fill a recording within a second, and show no motion of a joint.
std::vector<std::string> large_types() {
  return {"sensor_msgs/msg/Image",
          "sensor_msgs/msg/CompressedImage",
          "sensor_msgs/msg/PointCloud2",
          "sensor_msgs/msg/LaserScan",
          "sensor_msgs/msg/CameraInfo",
          "nav_msgs/msg/OccupancyGrid",
          "rcl_interfaces/msg/ParameterEvent"};
}

}  // namespace

MotionRecording::MotionRecording(Bus& bus, const CompiledWorld& world, const Log& log,
                                 const MotionRecordingOptions& options)
    : options_(options), bus_(bus) {
  RecorderOptions recorder;
  recorder.bag.folder = "motion";
  recorder.bag.sink = &sink_;
  recorder.bag.distro = to_string(ros_distro());
  recorder.topics = {.all = true};
  recorder.topics.exclude_types = large_types();
  recorder.topics.exclude_topics = {kInputsTopic, kStateHashTopic};  // of runs that can be run again
  recorder.ring_bytes = kRing;
  recorder.listed = false;
  recorder.on_loop = true;
  std::vector<std::string> omitted;
  recorder.attachments = mesh_attachments(world.instances(), options.max_mesh_bytes, omitted);
  if (!omitted.empty())
    notes_.push_back(fmt::format("{} meshes are not in the recording, because they are too large: {}",
                                 omitted.size(), omitted.front()));
  recorder_ = std::make_unique<BusRecorder>(bus, std::move(recorder), log);
}

void MotionRecording::take() {
  if (recorder_ == nullptr) return;
  recorder_->take();
  if (recorder_->size() < options_.max_bytes) return;
  notes_.push_back(fmt::format("the recording ends at {:.3f} s, because it has {:.3g} MB",
                               to_seconds(bus_.now()),
                               static_cast<double>(options_.max_bytes) / static_cast<double>(kMegabyte)));
  recorder_->stop();
  recorder_.reset();
}

RecordedMotion MotionRecording::finish() {
  if (recorder_ != nullptr) {
    const RecorderReport& report = recorder_->stop();
    if (!report.failure.empty()) notes_.push_back("the recording ends early: " + report.failure);
    for (const auto& [topic, count] : report.lost)
      notes_.push_back(fmt::format("{} messages of {} are not in the recording", count, topic));
  }
  recorder_.reset();
  return {sink_.take(), std::move(notes_)};
}

}  // namespace doppel
