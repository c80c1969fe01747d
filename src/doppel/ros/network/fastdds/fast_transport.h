#pragma once
// The transports of the participant, and the networks that they reach.

#include <atomic>
#include <condition_variable>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <functional>
#include <memory>
#include <mutex>
#include <span>

#include "doppel/ros/network/detail/rtps_discovery.h"
#include "doppel/ros/network/detail/rtps_guard.h"
#include "doppel/ros/network/environment.h"
#include "doppel/ros/network/fastdds/fast_acknowledgements.h"
#include "doppel/ros/network/fastdds/fast_dds.h"

namespace doppel::ros2::fast {

// Holds back incoming datagrams until open(); they stay in the sockets.
//
// Fast DDS announces a new participant before it listens: immediate replies would be lost, and discovery
// would be delayed by up to three seconds, until the peer's next announcement.
class ReceiveGate {
 public:
  ReceiveGate(std::shared_ptr<Acknowledgements> acknowledgements,
              std::shared_ptr<AnnouncedEndpoints> endpoints)
      : acknowledgements_(std::move(acknowledgements)), discovery_(std::move(endpoints)) {}
  void open();
  // Calls `deliver` with the datagram as Fast DDS may process it, if it may at all. Waits for open(), but not
  // forever: a participant whose creation fails is destroyed unopened.
  void receive(std::span<const std::uint8_t> datagram,
               const std::function<void(std::span<const std::uint8_t>)>& deliver);
  [[nodiscard]] std::uint64_t refused() const { return refused_.load(std::memory_order_relaxed); }

 private:
  bool admits(std::span<const std::uint8_t> datagram);

  std::mutex mutex_;
  std::condition_variable opened_;
  bool is_open_ = false;
  RtpsGuard guard_;
  const std::shared_ptr<Acknowledgements> acknowledgements_;
  std::mutex announcements_mutex_;  // held while Fast DDS processes one
  RtpsDiscovery discovery_;
  std::atomic<std::uint64_t> refused_{0};
};

// Transports, ports, peers and lease by `options`. Throws NetworkError: no interface, no free port.
dds::DomainParticipantQos participant_qos(const ParticipantOptions& options,
                                          std::shared_ptr<ReceiveGate> receive_gate);

}  // namespace doppel::ros2::fast
