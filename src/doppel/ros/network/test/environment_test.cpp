#include "doppel/ros/network/environment.h"

#include <gtest/gtest.h>

#include <map>

namespace doppel::ros2 {
namespace {

struct Read {
  ParticipantOptions options;
  Diagnostics diagnostics;
};

Read read(const std::map<std::string, std::string>& variables) {
  Read result;
  result.options = from_environment(
      [&](const char* name) {
        const auto at = variables.find(name);
        return at == variables.end() ? nullptr : at->second.c_str();
      },
      result.diagnostics);
  return result;
}

TEST(Environment, DefaultRangeIsLocalhost) {
  const Read r = read({});
  EXPECT_EQ(r.options.domain, 0u);
  EXPECT_EQ(r.options.range, DiscoveryRange::localhost);
  EXPECT_TRUE(r.diagnostics.all().empty());
}

TEST(Environment, DomainBeyond232IsRefused) {
  EXPECT_EQ(read({{"ROS_DOMAIN_ID", "232"}}).options.domain, 232u);
  EXPECT_EQ(read({{"ROS_DOMAIN_ID", ""}}).options.domain, 0u);
  for (const char* bad : {"233", "-1", "x", "1x", " 1", "99999999999999999999"})
    EXPECT_THROW(read({{"ROS_DOMAIN_ID", bad}}), InputError) << bad;
}

TEST(Environment, RangeAndPeersAreRead) {
  const Read r =
      read({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"}, {"ROS_STATIC_PEERS", "10.0.0.1;;arm.local;"}});
  EXPECT_EQ(r.options.range, DiscoveryRange::subnet);
  EXPECT_EQ(r.options.static_peers, (std::vector<std::string>{"10.0.0.1", "arm.local"}));
  EXPECT_TRUE(r.diagnostics.all().empty());
}

TEST(Environment, UnknownRangeIsLocalhostAndReported) {
  const Read r = read({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNETS"}});
  EXPECT_EQ(r.options.range, DiscoveryRange::localhost);
  ASSERT_EQ(r.diagnostics.all().size(), 1u);
  EXPECT_NE(r.diagnostics.all()[0].message.find("did you mean 'SUBNET'"), std::string::npos);
}

TEST(Environment, DeprecatedVariableWins) {
  const Read r = read({{"ROS_LOCALHOST_ONLY", "1"},
                       {"ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"},
                       {"ROS_STATIC_PEERS", "10.0.0.1"}});
  EXPECT_EQ(r.options.range, DiscoveryRange::localhost);
  EXPECT_TRUE(r.options.static_peers.empty());
  EXPECT_EQ(r.diagnostics.count(Severity::warning), 1u);
}

TEST(Environment, PeersWithoutRangeAreReported) {
  const Read r = read({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"}, {"ROS_STATIC_PEERS", "10.0.0.1"}});
  EXPECT_TRUE(r.options.static_peers.empty());
  EXPECT_EQ(r.diagnostics.count(Severity::warning), 1u);
}

}  // namespace
}  // namespace doppel::ros2
