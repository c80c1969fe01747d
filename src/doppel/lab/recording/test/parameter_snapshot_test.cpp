#include "doppel/lab/recording/parameter_snapshot.h"

#include <gmock/gmock.h>

namespace doppel {
namespace {

using rcl_interfaces::msg::ParameterEvent;
using testing::HasSubstr;
using testing::Not;

ParameterEvent event_of(const std::string& node, const std::vector<std::string>& names) {
  ParameterEvent out;
  out.node = node;
  for (const std::string& name : names) out.changed_parameters.emplace_back().name = name;
  return out;
}

TEST(ParameterSnapshot, ChangesOfNodesAreFollowed) {
  Bus bus;
  Node arm(bus, "/arm");
  arm.parameters().declare("speed", 1.5);
  ParameterSnapshot snapshot(bus);
  EXPECT_THAT(snapshot.text(), HasSubstr("speed: 1.5"));
  ASSERT_TRUE(arm.parameters().set("speed", 2.5));
  snapshot.apply(event_of("/arm", {"speed"}));
  bus.spin();
  EXPECT_THAT(snapshot.text(), HasSubstr("speed: 2.5"));
}

TEST(ParameterSnapshot, NamesThatNoNodeHasAreNotKept) {
  Bus bus;
  Node arm(bus, "/arm");
  arm.parameters().declare("speed", 1.5);
  ParameterSnapshot snapshot(bus);
  const std::string before = snapshot.text();
  for (int i = 0; i < 100; ++i) {
    snapshot.apply(event_of("/arm", {"invented" + std::to_string(i)}));
    snapshot.apply(event_of("/nobody" + std::to_string(i), {"speed"}));
  }
  bus.spin();
  EXPECT_EQ(snapshot.text(), before);
}

TEST(ParameterSnapshot, NodesThatAreGoneAreForgotten) {
  Bus bus;
  Node arm(bus, "/arm");
  arm.parameters().declare("speed", 1.5);
  auto guest = std::make_unique<Node>(bus, "/guest");
  guest->parameters().declare("colour", std::string("red"));
  ParameterSnapshot snapshot(bus);
  EXPECT_THAT(snapshot.text(), HasSubstr("colour"));
  guest.reset();
  snapshot.apply(event_of("/arm", {"speed"}));
  bus.spin();
  EXPECT_THAT(snapshot.text(), Not(HasSubstr("colour")));
  EXPECT_THAT(snapshot.text(), HasSubstr("speed"));
}

}  // namespace
}  // namespace doppel
