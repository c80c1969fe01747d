// Services that stand in for those of another program, and step back where it runs, on a network in memory.
#include <gmock/gmock.h>

#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/network/test/bridge_testing.h"

namespace doppel::ros2 {
namespace {

using std_srvs::srv::Trigger;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

class BridgeYieldingTest : public BridgeTest {
 protected:
  BridgeYieldingTest() {
    planner.set_yielding();
    for (const char* service : {"/compute_ik", "/compute_fk"})
      planner.serve<Trigger>(service, [](const auto&, const auto& respond) { respond({.message = "twin"}); });
  }
  static ServiceServer server_of(Participant& participant, const std::string& name) {
    return {participant,
            {.name = name, .type = "std_srvs/srv/Trigger", .request_hash = "", .response_hash = ""}};
  }
  // True if the bridge has a server of it.
  [[nodiscard]] bool is_offered(std::string_view service) const {
    const auto graph = bridge->graph();
    const auto arm = std::ranges::find(graph->nodes, "/arm", &GraphNode::name);
    return arm != graph->nodes.end() && std::ranges::any_of(peer->endpoints(), [&](const EndpointInfo& end) {
             return is_same_participant(end.gid, arm->participant) &&
                    end.topic == dds_name(NameKind::request, service);
           });
  }
  [[nodiscard]] bool are_offered(bool ik, bool fk) {
    return comes_true([&] {
      return !bridge->graph()->nodes.empty() && is_offered("/compute_ik") == ik &&
             is_offered("/compute_fk") == fk;
    });
  }

  doppel::Node planner{bus, "/move_group"};
};

TEST_F(BridgeYieldingTest, NameThatAnotherProgramServesIsNotOffered) {
  std::optional<ServiceServer> server(server_of(*peer, "/compute_ik"));
  start();
  ASSERT_TRUE(are_offered(false, true)) << "expected the name that the other program does not serve";
  const auto page = bus.attach("/_page");
  std::string answer;
  page->call("/compute_ik", to_cdr(Trigger::Request{}), [&answer](const Status&, const Bytes& bytes) {
    Trigger::Response response;
    if (from_cdr(bytes, response)) answer = response.message;
  });
  EXPECT_TRUE(comes_true([&] { return answer == "twin"; })) << "expected the twin's own for its page";
  server.reset();
  ASSERT_TRUE(are_offered(true, true));
  server.emplace(server_of(*peer, "/compute_ik"));
  ASSERT_TRUE(are_offered(false, true));
  const std::lock_guard lock(mutex);
  EXPECT_THAT(said, Contains(AllOf(HasSubstr("serves /compute_ik:"), HasSubstr("--move-group on"))));
  EXPECT_THAT(said, Contains("the twin serves /compute_ik on the network again"));
}

TEST_F(BridgeYieldingTest, NodeOfEqualNameIsAnnouncedOnce) {
  Graph graph(*peer);
  graph.set_own_nodes({{.name = "/move_group"}});
  start();
  const auto move_groups = [&graph] {
    graph.update();
    return std::ranges::count(graph.nodes(), "/move_group", &GraphNode::name);
  };
  ASSERT_TRUE(comes_true([&] {
    graph.update();
    return std::ranges::count(graph.nodes(), "/_ros2", &GraphNode::name) == 1;
  }));
  EXPECT_EQ(move_groups(), 1);
  graph.set_own_nodes({});
  EXPECT_TRUE(comes_true([&] { return move_groups() == 1; })) << "expected the twin's own again";
}

TEST_F(BridgeYieldingTest, OneOfTwoTwinsServes) {
  Graph first(*peer);
  first.set_own_nodes({{.name = "/left/doppel"}});
  std::optional<ServiceServer> of_first(server_of(*peer, "/compute_ik"));
  start();
  ASSERT_TRUE(are_offered(false, true));
  of_first.reset();
  ASSERT_TRUE(are_offered(true, true));
  const auto later = network.join([] {});
  Graph second(*later);
  second.set_own_nodes({{.name = "/right/doppel"}});
  ASSERT_TRUE(comes_true(
      [&] { return std::ranges::count(bridge->graph()->nodes, "/right/doppel", &GraphNode::name) == 1; }));
  const ServiceServer of_second = server_of(*later, "/compute_ik");
  run_for(milliseconds(400));
  EXPECT_TRUE(are_offered(true, true)) << "expected the later one to yield";
}

TEST_F(BridgeYieldingTest, OffersWhateverOthersDoIfAsked) {
  const ServiceServer server = server_of(*peer, "/compute_ik");
  start({.yielding = Yielding::never});
  ASSERT_TRUE(are_offered(true, true));
  run_for(milliseconds(400));
  EXPECT_TRUE(are_offered(true, true));
}

TEST_F(BridgeYieldingTest, OffersNothingIfAsked) {
  start({.yielding = Yielding::always});
  node.serve<Trigger>("~/go", [](const auto&, const auto& respond) { respond({}); });
  ASSERT_TRUE(comes_true([&] { return is_offered("/arm/go"); }));
  EXPECT_TRUE(are_offered(false, false));
}

}  // namespace
}  // namespace doppel::ros2
