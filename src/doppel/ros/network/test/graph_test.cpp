#include "doppel/ros/network/graph.h"

#include <algorithm>

#include "doppel/ros/messages/rmw_dds_common.h"
#include "doppel/ros/network/service.h"
#include "network.h"

namespace doppel::ros2::test {
namespace {

class GraphTest : public testing::Test {
 protected:
  OwnDomain domain_;
  Activity activity_;
  std::unique_ptr<Participant> here_ = make_participant(on_domain(domain_), activity_.signal());
  std::unique_ptr<Participant> there_ = make_participant(on_domain(domain_), activity_.signal());
  Graph graph_{*here_};

  template <class Condition>
  bool sees(Condition condition) {
    return activity_.wait([&] {
      graph_.update();
      return condition();
    });
  }
  bool sees_node(const std::string& name) {
    return sees([&] { return has_node(name); });
  }
  [[nodiscard]] bool has_node(const std::string& name) const {
    return std::any_of(graph_.nodes().begin(), graph_.nodes().end(),
                       [&](const GraphNode& n) { return n.name == name; });
  }
};

TEST_F(GraphTest, NodesListTheirEndpoints) {
  Graph other(*there_);
  const auto writer = there_->make_writer(text_topic());
  const ServiceServer server(*there_, {"/left/talker/go", "std_srvs/srv/Trigger", "", ""});
  other.set_own_nodes(
      {{"/left/talker", {server.requests().gid()}, {writer->gid(), server.replies().gid()}}, {"/idle"}});
  ASSERT_TRUE(sees_node("/left/talker"));
  ASSERT_EQ(graph_.nodes().size(), 2u);
  EXPECT_EQ(graph_.nodes()[0].name, "/idle");
  EXPECT_EQ(graph_.nodes()[1].participant, there_->gid());
  EXPECT_EQ(graph_.nodes()[1].enclave, "/");

  ASSERT_TRUE(sees([&] { return graph_.topics().size() == 1 && graph_.services().size() == 1; }));
  const GraphTopic& topic = graph_.topics()[0];
  EXPECT_EQ(topic.name, "/text");
  ASSERT_EQ(topic.publishers.size(), 1u);
  EXPECT_EQ(topic.publishers[0].node, "/left/talker");
  EXPECT_EQ(topic.publishers[0].type, "std_msgs/msg/String");
  const GraphService& service = graph_.services()[0];
  EXPECT_EQ(service.name, "/left/talker/go");
  ASSERT_EQ(service.servers.size(), 1u);
  EXPECT_EQ(service.servers[0].type, "std_srvs/srv/Trigger");
  EXPECT_TRUE(service.clients.empty());
}

TEST_F(GraphTest, OwnEndpointsCarryJazzyTypeHash) {
  const auto endpoints = here_->endpoints();
  ASSERT_EQ(endpoints.size(), 2u);
  for (const EndpointInfo& e : endpoints) {
    EXPECT_EQ(e.topic, "ros_discovery_info");
    EXPECT_EQ(e.type_hash, "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e");
  }
}

TEST_F(GraphTest, OwnNodesAreListed) {
  graph_.set_own_nodes({{"/me"}});
  EXPECT_TRUE(graph_.update());
  ASSERT_TRUE(has_node("/me"));
  EXPECT_FALSE(graph_.nodes()[0].enclave.empty());
}

TEST_F(GraphTest, ControlCharactersInNamesAreEscaped) {
  Graph other(*there_);
  other.set_own_nodes({{"/a\x1b[2J"}, {"/\xc2\x9b/b\x07"}});
  EXPECT_TRUE(sees_node("/a?[2J"));
  EXPECT_TRUE(has_node("/?/b?"));
}

TEST_F(GraphTest, ChangesAreReported) {
  Graph other(*there_);
  other.set_own_nodes({{"/a"}});
  ASSERT_TRUE(sees_node("/a"));
  other.set_own_nodes({{"/b"}});
  ASSERT_TRUE(sees_node("/b"));
  EXPECT_FALSE(has_node("/a"));
}

TEST_F(GraphTest, NodesVanishWithParticipant) {
  auto other = std::make_unique<Graph>(*there_);
  other->set_own_nodes({{"/a"}});
  ASSERT_TRUE(sees_node("/a"));
  other.reset();
  there_.reset();
  EXPECT_TRUE(sees([&] { return graph_.nodes().empty(); }));
}

TEST_F(GraphTest, UnclaimedEndpointsAreReported) {
  const auto writer = there_->make_writer(text_topic());
  ASSERT_TRUE(sees([&] { return graph_.topics().size() == 1; }));
  EXPECT_EQ(graph_.topics()[0].publishers[0].node, "_NODE_NAME_UNKNOWN_");
}

TEST_F(GraphTest, ForeignAndMalformedGraphDataIsIgnored) {
  const EndpointSpec spec{"ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", "",
                          latched_qos(10)};
  const auto writer = there_->make_writer(spec);
  rmw_dds_common::msg::ParticipantEntitiesInfo info;
  info.gid.data = here_->gid().bytes;
  info.node_entities_info_seq.push_back({"/", "forged", {}, {}});
  writer->write(to_cdr(info));
  writer->write(Bytes(5, std::byte{0xff}));
  info.gid.data = there_->gid().bytes;
  info.node_entities_info_seq[0].node_name = "honest";
  writer->write(to_cdr(info));
  ASSERT_TRUE(sees_node("/honest"));
  EXPECT_EQ(graph_.nodes().size(), 1u);
}

}  // namespace
}  // namespace doppel::ros2::test
