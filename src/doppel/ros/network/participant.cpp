#include "doppel/ros/network/participant.h"

#include "doppel/base/core/plugin_module.h"
#include "doppel/ros/network/detail/participant.h"
#include "doppel/ros/network/detail/static_peers.h"
#include "doppel/ros/network/environment.h"

namespace doppel::ros2 {

std::unique_ptr<Participant> make_participant(const ParticipantOptions& options,
                                              std::function<void()> on_activity) {
  try {
    static const auto make =
        reinterpret_cast<detail::MakeParticipant>(plugin_symbol("doppel_fastdds", detail::kMakeParticipant));
    ParticipantOptions resolved = options;
    resolved.static_peers = addresses_of(options.static_peers, options.is_cancelled);
    return std::unique_ptr<Participant>(make(resolved, std::move(on_activity)));
  } catch (const NetworkError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw NetworkError(std::string("ROS 2 is not available: ") + error.what());
  }
}

}  // namespace doppel::ros2
