// joint_trajectory_controller as an action server, over the bus.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/control/test/jtc_rig.h"

namespace doppel {
namespace {

using testing::HasSubstr;
using Result = FollowJointTrajectory::Result;
const std::vector<std::string> kJoints = {"a", "b", "c"};

TEST(JtcAction, B52_SucceedsAtTheLastPointAndNotBefore) {
  JtcRig rig;
  const double start = rig.time();
  const auto goal = rig.send(trajectory(kJoints, {point(1.0, {1, 0.5, -0.5})}));
  ASSERT_TRUE(rig.answers[goal].accepted.value_or(false)) << rig.said();
  rig.run_for(0.99);
  EXPECT_FALSE(rig.answers[goal].finished_at);
  rig.run_for(0.2);
  ASSERT_TRUE(rig.answers[goal].finished_at);
  EXPECT_GE(*rig.answers[goal].finished_at, start + 1.0);
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::succeeded);
  EXPECT_EQ(rig.answers[goal].result.error_code, Result::SUCCESSFUL);
  EXPECT_DOUBLE_EQ(rig.hardware->position("a"), 1.0);
  EXPECT_DOUBLE_EQ(rig.hardware->position("c"), -0.5);
}

}  // namespace
}  // namespace doppel
