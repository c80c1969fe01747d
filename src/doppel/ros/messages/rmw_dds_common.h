#pragma once
// ROS 2's rmw_dds_common: the nodes of the endpoints of a DDS participant, published on ros_discovery_info.

#include "doppel/ros/messages/message.h"

namespace doppel::rmw_dds_common::msg {

struct Gid {
  std::array<std::uint8_t, 16> data{};  // RTPS: twelve bytes of the participant, four of the entity
  DOPPEL_MESSAGE("rmw_dds_common/msg/Gid", data)
};

struct NodeEntitiesInfo {
  BoundedString<256> node_namespace, node_name;
  std::vector<Gid> reader_gid_seq, writer_gid_seq;
  DOPPEL_MESSAGE("rmw_dds_common/msg/NodeEntitiesInfo", node_namespace, node_name, reader_gid_seq,
                 writer_gid_seq)
};

struct ParticipantEntitiesInfo {
  Gid gid;
  std::vector<NodeEntitiesInfo> node_entities_info_seq;
  DOPPEL_MESSAGE("rmw_dds_common/msg/ParticipantEntitiesInfo", gid, node_entities_info_seq)
};

}  // namespace doppel::rmw_dds_common::msg
