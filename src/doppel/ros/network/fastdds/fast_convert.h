#pragma once
// Conversions between the types of this module and those of Fast DDS.

#include <fastdds/rtps/common/Guid.h>
#include <fastdds/rtps/common/SampleIdentity.h>

#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/publisher/qos/WriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/subscriber/qos/ReaderQos.hpp>

#include "doppel/ros/network/participant.h"

namespace doppel::ros2::fast {

Gid gid_of(const eprosima::fastrtps::rtps::GUID_t& guid);
SampleIdentity identity_of(const eprosima::fastrtps::rtps::SampleIdentity& identity);
eprosima::fastrtps::rtps::SampleIdentity identity_of(const SampleIdentity& identity);

// The qualities of service with which rmw_fastrtps sets up its endpoints (qos.cpp, publisher.cpp,
// subscription.cpp of its branch jazzy).
eprosima::fastdds::dds::DataWriterQos writer_qos(const EndpointSpec& spec);
eprosima::fastdds::dds::DataReaderQos reader_qos(const EndpointSpec& spec);

// The QoS of a peer's endpoint from discovery, which does not include history and depth.
QosProfile profile_of(const eprosima::fastdds::dds::WriterQos& qos);
QosProfile profile_of(const eprosima::fastdds::dds::ReaderQos& qos);

}  // namespace doppel::ros2::fast
