#pragma once
// The network's participants and endpoints: the results of Fast DDS's discovery, and this
// participant's own endpoints.

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>

#include "doppel/ros/network/detail/rtps_discovery.h"
#include "doppel/ros/network/fastdds/fast_addressing.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2::fast {

class Discovery : public DiscoveryListener {
 public:
  Discovery(std::function<void()> on_activity, std::shared_ptr<AnnouncedEndpoints> announced)
      : on_activity_(std::move(on_activity)), announced_(std::move(announced)) {}

  // Includes this participant.
  void add(ParticipantInfo participant);
  void add(EndpointInfo endpoint);
  void remove(const Gid& endpoint);

  [[nodiscard]] const ReaderPlaces& reply_readers() const { return reply_readers_; }
  [[nodiscard]] std::uint64_t version() const { return version_.load(std::memory_order_acquire); }
  [[nodiscard]] std::vector<EndpointInfo> endpoints() const;
  [[nodiscard]] std::vector<ParticipantInfo> participants() const;

 private:
  void participant_changed(const ParticipantData& data, bool left) override;
  void reader_changed(const ReaderData& data, bool left) override;
  void writer_changed(const WriterData& data, bool left) override;
  void remove_participant(const Gid& gid);
  void changed();

  const std::function<void()> on_activity_;
  const std::shared_ptr<AnnouncedEndpoints> announced_;
  std::atomic<std::uint64_t> version_{0};
  mutable std::mutex mutex_;
  std::map<Gid, EndpointInfo> endpoints_;
  std::size_t writers_ = 0;  // among those
  std::map<Gid, ParticipantInfo> participants_;
  ReaderPlaces reply_readers_;
};

}  // namespace doppel::ros2::fast
