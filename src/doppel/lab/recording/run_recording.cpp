#include "doppel/lab/recording/run_recording.h"

#include <fmt/format.h>

#include <ctime>
#include <variant>

#include "doppel/lab/recording/run_files.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/distro.h"
#include "doppel/twin/journal/input_journal.h"

namespace doppel {
namespace {

constexpr const char* kIntrospection = "service_introspection";

// The parameter shows what services do, so that it is set instead of the bus.
void publish_service_calls(Bus& bus) {
  if (bus.service_events() != ServiceEvents::off) return;
  bus.each_node([](Node& node) {
    if (node.parameters().find(kIntrospection) != nullptr)
      static_cast<void>(node.parameters().set(kIntrospection, std::string("contents")));
  });
}

}  // namespace

RecorderOptions run_recorder_options(Twin& twin, RunRecordingOptions options, const Log& log) {
  publish_service_calls(twin.bus());
  RunFiles files = run_files(run_sources(twin), options.version, options.max_mesh_bytes);
  if (!files.omitted.empty() && options.max_mesh_bytes > 0) {
    log.note("record", fmt::format("{} meshes are not in the recording, because they are too large: {}",
                                   files.omitted.size(), files.omitted.front()));
  }
  files.about.emplace_back(kKeepsStates, options.keeps_states ? "yes" : "no");
  RecorderOptions out;
  out.bag = std::move(options.bag);
  out.bag.distro = to_string(ros_distro());
  out.topics = std::move(options.topics);
  out.attachments = std::move(files.attachments);
  out.metadata = {{kFilesOfRunMetadata, std::move(files.places)}, {kRunMetadata, std::move(files.about)}};
  // Without them the run could not be run again.
  out.unpaused = {kInputsTopic, kStateHashTopic};
  return out;
}

std::filesystem::path dated_bag_folder(const std::filesystem::path& parent) {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  localtime_r(&now, &parts);
  char text[64];
  std::strftime(text, sizeof text, "rosbag2_%Y_%m_%d-%H_%M_%S", &parts);
  std::filesystem::path out = parent / text;
  for (int number = 2; std::filesystem::exists(out); ++number)
    out = parent / fmt::format("{}_{}", text, number);
  return out;
}

}  // namespace doppel
