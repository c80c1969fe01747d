#pragma once
// Conversions between the types of this module and those of Fast DDS.

#include "doppel/ros/network/fastdds/fast_dds.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2::fast {

Gid gid_of(const rtps::GUID_t& guid);
SampleIdentity identity_of(const rtps::SampleIdentity& identity);
rtps::SampleIdentity identity_of(const SampleIdentity& identity);

// The qualities of service with which rmw_fastrtps sets up its endpoints (qos.cpp, publisher.cpp,
// subscription.cpp of its branch jazzy).
dds::DataWriterQos writer_qos(const EndpointSpec& spec);
dds::DataReaderQos reader_qos(const EndpointSpec& spec);

// The QoS of a peer's endpoint from discovery, which does not include history and depth.
QosProfile profile_of(const WriterData& writer);
QosProfile profile_of(const ReaderData& reader);

}  // namespace doppel::ros2::fast
