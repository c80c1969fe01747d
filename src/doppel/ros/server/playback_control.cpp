#include "doppel/ros/server/playback_control.h"

namespace doppel {

void PlaybackControl::request(foxglove::PlaybackRequest request) {
  constexpr std::size_t kMaxRequests = 1000;  // of clients that are faster than the player
  const std::lock_guard lock(mutex_);
  if (requests_.size() < kMaxRequests) requests_.push_back(std::move(request));
}

void PlaybackControl::on_report(std::function<void(const foxglove::PlaybackState&)> callback) {
  const std::lock_guard lock(mutex_);
  callback_ = std::move(callback);
}

std::vector<foxglove::PlaybackRequest> PlaybackControl::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(requests_, {});
}

void PlaybackControl::report(const foxglove::PlaybackState& state) {
  const std::lock_guard lock(mutex_);
  if (callback_) callback_(state);
}

}  // namespace doppel
