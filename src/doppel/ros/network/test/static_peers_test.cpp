#include "doppel/ros/network/detail/static_peers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "doppel/ros/network/participant.h"

namespace doppel::ros2 {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(StaticPeers, AddressNeedsNoLookup) {
  const auto nobody = [](const std::string& name) -> std::string {
    ADD_FAILURE() << "expected no lookup of " << name;
    return "";
  };
  EXPECT_THAT(addresses_of({"127.0.0.1", "10.0.0.7"}, {}, nobody), ElementsAre("127.0.0.1", "10.0.0.7"));
  EXPECT_EQ(look_up("127.0.0.1"), "127.0.0.1");
  EXPECT_EQ(look_up("localhost"), "127.0.0.1");
}

TEST(StaticPeers, HostNameIsLookedUp) {
  const auto lookup = [](const std::string& name) { return name == "arm" ? "10.0.0.8" : ""; };
  EXPECT_THAT(addresses_of({"10.0.0.7", "arm"}, {}, lookup), ElementsAre("10.0.0.7", "10.0.0.8"));
  try {
    addresses_of({"arm", "amr"}, {}, lookup);
    FAIL() << "expected a NetworkError: the host does not exist";
  } catch (const NetworkError& error) {
    EXPECT_THAT(error.what(), HasSubstr("'amr'"));
  }
}

TEST(StaticPeers, LookupExceptionIsNetworkError) {
  const auto lookup = [](const std::string&) -> std::string { throw 42; };
  try {
    addresses_of({"robot"}, {}, lookup);
    FAIL() << "expected a NetworkError";
  } catch (const NetworkError& error) {
    EXPECT_NE(std::string(error.what()).find("cannot look up"), std::string::npos) << error.what();
  }
}

TEST(StaticPeers, UnresponsiveResolverIsAbandoned) {
  std::promise<void> answer;
  const auto lookup = [wait = std::shared_future<void>(answer.get_future())](const std::string&) {
    wait.wait();
    return std::string("10.0.0.8");
  };
  EXPECT_THROW(addresses_of(
                   {"arm"}, [] { return true; }, lookup),
               NetworkError);
  answer.set_value();
}

}  // namespace
}  // namespace doppel::ros2
