#pragma once
// How far the participant's packets go.

#include <condition_variable>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <memory>
#include <mutex>

#include "doppel/ros2/environment.h"

namespace doppel::ros2::fast {

// Fast DDS announces a new participant before it listens: answers that come at once would be lost, and with
// them up to three seconds, until the peer's next announcement. Closed, the gate keeps what comes in the
// sockets.
class Gate {
 public:
  void open();
  void wait();  // not for ever: a participant that could not be made is destroyed behind a closed gate

 private:
  std::mutex mutex_;
  std::condition_variable opened_;
  bool is_open_ = false;
};

// Transports, ports, peers and lease by `options`. Throws NetworkError: no interface, no free port, a peer of
// unknown name.
eprosima::fastdds::dds::DomainParticipantQos participant_qos(const ParticipantOptions& options,
                                                             std::shared_ptr<Gate> gate);

}  // namespace doppel::ros2::fast
