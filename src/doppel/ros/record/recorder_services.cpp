#include "doppel/ros/record/recorder_services.h"

#include <utility>

#include "doppel/ros/messages/rosbag2_interfaces.h"

namespace doppel {

namespace recorder_srv = rosbag2_interfaces::srv;

// Without an answer by `done` the caller gets an error.
template <Service S>
void RecorderServices::serve(const char* name, RecorderAction action) {
  node_.serve<S>(name,
                 [this, action](const auto& /*request*/, const Responder<typename S::Response>& respond) {
                   control_.act(action, [respond](bool done) {
                     if (done) respond({});
                   });
                 });
}

RecorderServices::RecorderServices(Bus& bus, RecorderControl control, const std::string& node)
    : control_(std::move(control)), node_(bus, node) {
  serve<recorder_srv::Pause>("~/pause", RecorderAction::pause);
  serve<recorder_srv::Resume>("~/resume", RecorderAction::resume);
  serve<recorder_srv::TogglePaused>("~/toggle_paused", RecorderAction::toggle_paused);
  serve<recorder_srv::SplitBagfile>("~/split_bagfile", RecorderAction::split);
  serve<recorder_srv::Stop>("~/stop", RecorderAction::stop);
  node_.serve<recorder_srv::IsPaused>(
      "~/is_paused",
      [this](const auto& /*request*/, const Responder<recorder_srv::IsPaused::Response>& respond) {
        respond({control_.is_paused()});
      });
  if (!control_.has_snapshot) return;
  node_.serve<recorder_srv::Snapshot>(
      "~/snapshot",
      [this](const auto& /*request*/, const Responder<recorder_srv::Snapshot::Response>& respond) {
        control_.act(RecorderAction::snapshot, [respond](bool done) { respond({done}); });
      });
}

}  // namespace doppel
