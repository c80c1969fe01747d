#include "doppel/devices/emulated_robot/detail/hand_sweep.h"

#include <gtest/gtest.h>

#include <array>

namespace doppel {
namespace {

TEST(HandSweep, EachJointReachesItsLimitsWhileOthersStand) {
  JointServo pan, lift;
  pan.lower = -1;
  pan.upper = 2;
  lift.lower = 0;
  lift.upper = 1;
  pan.velocity = lift.velocity = 5;
  const HandSweep sweep({pan, lift});
  std::array<double, 2> least{9, 9}, most{-9, -9}, q{}, before{0.5, 0.5};
  for (int i = 0; i < 2000; ++i) {
    sweep.positions(0.01 * i, q);
    for (std::size_t j = 0; j < 2; ++j) {
      least[j] = std::min(least[j], q[j]);
      most[j] = std::max(most[j], q[j]);
      EXPECT_LE(std::abs(q[j] - before[j]), 0.8 * 0.01 + 1e-9) << "a hand's speed, at " << 0.01 * i << " s";
    }
    EXPECT_TRUE(q[0] == 0.5 || q[1] == 0.5) << "one joint after the other";
    before = q;
  }
  EXPECT_NEAR(least[0], -1, 0.01);
  EXPECT_NEAR(most[0], 2, 0.01);
  EXPECT_NEAR(least[1], 0, 0.01);
  EXPECT_NEAR(most[1], 1, 0.01);
}

}  // namespace
}  // namespace doppel
