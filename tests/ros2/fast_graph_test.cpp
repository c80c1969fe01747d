// What discovery reports about the twin: its nodes (ros_discovery_info), the node of each endpoint, and the
// types' hashes.

#include <gtest/gtest.h>
#include <rmw_dds_common.h>

#include <regex>
#include <set>

#include "fast_twin_test.h"
#include "published_hashes.h"

namespace doppel::ros2_testing {
namespace {

using rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_;
using Gid = std::array<std::uint8_t, 16>;

Gid gid_of(const GUID_t& guid) {
  Gid gid;
  std::copy_n(guid.guidPrefix.value, 12, gid.begin());
  std::copy_n(guid.entityId.value, 4, gid.begin() + 12);
  return gid;
}

// "sensor_msgs::msg::dds_::JointState_" -> "sensor_msgs/msg/JointState"
std::string ros_name(const std::string& dds_type) {
  static const std::regex form("(\\w+)::(\\w+)::dds_::(\\w+)_");
  std::smatch parts;
  return std::regex_match(dds_type, parts, form) ? parts.str(1) + "/" + parts.str(2) + "/" + parts.str(3)
                                                 : "";
}

class FastGraph : public FastTwinTest {
 protected:
  // The latest list that contains this node.
  ParticipantEntitiesInfo_ list_with(const std::string& name) {
    return lists
        .next([&](const ParticipantEntitiesInfo_& list) {
          for (const auto& node : list.node_entities_info_seq_())
            if (name == node.node_name_().c_str()) return true;
          return false;
        })
        .value();
  }
  std::map<Gid, SeenEndpoint> endpoints_by_gid() {
    std::map<Gid, SeenEndpoint> all;
    for (const SeenEndpoint& endpoint : peer.endpoints())
      if (endpoint.guid.guidPrefix != peer.guid().guidPrefix) all[gid_of(endpoint.guid)] = endpoint;
    return all;
  }
  Subscription<ParticipantEntitiesInfo_> lists =
      peer.subscribe<ParticipantEntitiesInfo_>("ros_discovery_info", {.latched = true, .depth = 0});
};

TEST_F(FastGraph, ParticipantCarriesEnclave) {
  ASSERT_TRUE(eventually([&] { return peer.participants().size() == 1; }));
  const SeenParticipant seen = peer.participants().begin()->second;
  EXPECT_EQ(seen.name, "/");
  EXPECT_EQ(seen.user_data, "enclave=/;");
}

TEST_F(FastGraph, NodesCarryNamespace) {
  const ParticipantEntitiesInfo_ list = list_with("omarm_gripper_controller");
  std::set<std::string> nodes;
  for (const auto& node : list.node_entities_info_seq_())
    nodes.insert(std::string(node.node_namespace_().c_str()) + " " + node.node_name_().c_str());
  for (const char* expected : {"controller_manager", "gazebo", "joint_state_broadcaster",
                               "omarm_arm_controller", "omarm_gripper_controller", "robot_state_publisher"})
    EXPECT_TRUE(nodes.contains(std::string("/ ") + expected)) << expected;
  ASSERT_TRUE(eventually([&] { return peer.participants().size() == 1; }));
  EXPECT_EQ(list.gid_().data_(), gid_of(peer.participants().begin()->first))
      << "expected the list's gid to be its participant's";
}

TEST_F(FastGraph, EveryEndpointBelongsToOneNode) {
  std::string problem;
  // The list and the endpoints arrive independently: both arrive in the end, in any order.
  EXPECT_TRUE(eventually([&] {
    problem.clear();
    static std::optional<ParticipantEntitiesInfo_> list;
    while (auto newer = lists.take()) list = newer->value;
    if (!list) return false;
    const std::map<Gid, SeenEndpoint> endpoints = endpoints_by_gid();
    std::map<Gid, int> owners;
    for (const auto& node : list->node_entities_info_seq_()) {
      for (const auto& gid : node.writer_gid_seq_()) ++owners[gid.data_()];
      for (const auto& gid : node.reader_gid_seq_()) ++owners[gid.data_()];
    }
    for (const auto& [gid, count] : owners) {
      if (count != 1) problem += "an endpoint of several nodes\n";
      if (!endpoints.contains(gid)) problem += "a node's endpoint that discovery does not know\n";
    }
    for (const auto& [gid, endpoint] : endpoints)
      if (endpoint.topic != "ros_discovery_info" && !owners.contains(gid))
        problem += endpoint.topic + " is no node's\n";
    return problem.empty() && !owners.empty();
  })) << problem;
}

TEST_F(FastGraph, JointStatesBelongToBroadcaster) {
  const ParticipantEntitiesInfo_ list = list_with("joint_state_broadcaster");
  ASSERT_TRUE(eventually([&] {
    for (const auto& [gid, endpoint] : endpoints_by_gid()) {
      if (endpoint.topic != "rt/joint_states" || !endpoint.is_writer) continue;
      for (const auto& node : list.node_entities_info_seq_())
        for (const auto& writer : node.writer_gid_seq_())
          if (writer.data_() == gid) {
            EXPECT_STREQ(node.node_name_().c_str(), "joint_state_broadcaster");
            EXPECT_EQ(endpoint.type, "sensor_msgs::msg::dds_::JointState_");
            return true;
          }
    }
    return false;
  }));
}

TEST_F(FastGraph, LatchedTopicsAreTransientLocal) {
  for (const char* topic : {"rt/robot_description", "rt/tf_static"}) {
    EXPECT_TRUE(eventually([&] {
      for (const auto& [gid, endpoint] : endpoints_by_gid())
        if (endpoint.topic == topic && endpoint.is_writer) return endpoint.latched && endpoint.reliable;
      return false;
    })) << topic;
  }
}

TEST_F(FastGraph, TypeHashesMatchDistro) {
  list_with("omarm_gripper_controller");  // all are there
  const std::map<std::string, std::string> published = published_hashes();
  ASSERT_FALSE(published.empty());
  static const std::regex form("typehash=RIHS01_[0-9a-f]{64};");
  int compared = 0;
  for (const auto& [gid, endpoint] : endpoints_by_gid()) {
    if (endpoint.topic == "ros_discovery_info" && endpoint.user_data.empty()) continue;
    EXPECT_TRUE(std::regex_match(endpoint.user_data, form)) << endpoint.topic << ": " << endpoint.user_data;
    const auto found = published.find(ros_name(endpoint.type));
    if (found == published.end()) continue;
    EXPECT_EQ(endpoint.user_data, "typehash=" + found->second + ";") << endpoint.topic;
    ++compared;
  }
  EXPECT_GT(compared, 10);
}

}  // namespace
}  // namespace doppel::ros2_testing
