#include "doppel/twin/assembly/runner.h"

#include <gtest/gtest.h>

namespace doppel {
namespace {

TEST(RunStatistics, RealTimeFactorIsSimulatedOverWall) {
  RunStatistics run;
  EXPECT_EQ(run.real_time_factor(), 0.0);
  run.simulated = from_seconds(3.0);
  run.wall = std::chrono::seconds(2);
  EXPECT_DOUBLE_EQ(run.real_time_factor(), 1.5);
}

}  // namespace
}  // namespace doppel
