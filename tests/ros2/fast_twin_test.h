#pragma once
// A twin that all tests of this program share, and a Fast DDS peer for each of them.

#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "fast_peer.h"
#include "twin_process.h"

namespace doppel::ros2_testing {

class FastTwinTest : public ::testing::Test {
 protected:
  static TwinProcess& twin() {
    static TwinProcess process;
    return process;
  }
  void SetUp() override { ASSERT_TRUE(twin().process().running()) << twin().output(); }
  void TearDown() override {
    if (HasFailure()) std::fputs(twin().output().c_str(), stderr);
  }
  FastPeer peer{own_domain()};
};

inline std::vector<std::string> arm_joints() {
  return {"Revolute 1", "Revolute 2", "Revolute 3", "Revolute 4", "Revolute 5", "Revolute 6"};
}

}  // namespace doppel::ros2_testing
