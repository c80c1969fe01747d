#pragma once
// A twin of Kate that all tests of this program share, and a Fast DDS peer for each of them.

#include <gtest/gtest.h>

#include <cstdio>

#include "fast_peer.h"
#include "twin_process.h"

namespace doppel::ros2_testing {

class FastKateTest : public ::testing::Test {
 protected:
  static TwinProcess& twin() {
    static TwinProcess process({"--no-reload"}, "kate");
    return process;
  }
  void SetUp() override { ASSERT_TRUE(twin().process().running()) << twin().output(); }
  void TearDown() override {
    if (HasFailure()) std::fputs(twin().output().c_str(), stderr);
  }
  FastPeer peer{own_domain()};
};

}  // namespace doppel::ros2_testing
