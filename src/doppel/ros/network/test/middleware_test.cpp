#include "doppel/ros/network/middleware.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "doppel/ros/network/test/published_faults.h"

namespace doppel::ros2 {
namespace {

bool has_fault(std::string_view version, std::string_view name) {
  return std::ranges::count(faults_of_fast_dds(version), name, &PublishedFault::name) == 1;
}

TEST(Middleware, FaultsAreThoseThatVersionPrecedes) {
  EXPECT_TRUE(has_fault("2.9.1", "CVE-2024-30258"));
  EXPECT_TRUE(has_fault("2.14.0", "CVE-2024-30258"));
  EXPECT_FALSE(has_fault("2.14.1", "CVE-2024-30258"));
  EXPECT_FALSE(has_fault("3.1.2", "CVE-2024-30258"));
  EXPECT_TRUE(has_fault("3.1.2", "CVE-2025-64438"));
  EXPECT_FALSE(has_fault("3.10.0", "CVE-2025-64438")) << "expected numbers to be compared, not texts";
  EXPECT_TRUE(has_fault("3.6.2", "CVE-2026-55063")) << "expected a fault without a fix to stay";
}

TEST(Middleware, VersionIsThatOfLibrary) {
  const std::string version = fast_dds_version();
  EXPECT_EQ(std::ranges::count(version, '.'), 2) << version;
  EXPECT_NE(describe_middleware(version).find(version), std::string::npos);
}

// Each fault of the list has a datagram that the guard keeps out, and no datagram has a fault of another
// name.
TEST(Middleware, EachFaultHasDatagram) {
  const auto faults = faults_of_fast_dds("0.0.0");
  const auto datagrams = ros2_testing::published_faults({});
  for (const PublishedFault& fault : faults) {
    EXPECT_TRUE(std::ranges::any_of(datagrams, [&](const auto& sent) {
      return std::string_view(sent.name).starts_with(fault.name);
    })) << fault.name;
  }
  for (const auto& sent : datagrams) {
    EXPECT_TRUE(std::ranges::any_of(faults, [&](const PublishedFault& fault) {
      return std::string_view(sent.name).starts_with(fault.name);
    })) << sent.name;
  }
}

}  // namespace
}  // namespace doppel::ros2
