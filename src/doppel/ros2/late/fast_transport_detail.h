#pragma once
// How far the participant's packets go.

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>

#include "doppel/ros2/environment.h"

namespace doppel::ros2::fast {

// Transports, ports, peers and lease by `options`. Throws NetworkError: no interface, no free port, a peer of
// unknown name.
eprosima::fastdds::dds::DomainParticipantQos participant_qos(const ParticipantOptions& options);

}  // namespace doppel::ros2::fast
