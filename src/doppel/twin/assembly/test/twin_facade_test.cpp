#include <gtest/gtest.h>

#include "doppel/twin/assembly/twin.h"

namespace doppel {
namespace {

using namespace std::chrono_literals;

TEST(TwinFacade, RunForTakesStepsOfItsDuration) {
  Twin twin("omarm_one");
  twin.run_for(1s);
  EXPECT_EQ(twin.now(), time_from_seconds(1.0));
  EXPECT_NEAR(twin.joint("Revolute 2").q(), twin.robot().joints()[1].q, 0);
  EXPECT_EQ(twin.joint("Revolute 2").effort(), twin.robot().joints()[1].tau);
}

TEST(TwinFacade, CommandOfFreeJointIsHeld) {
  Twin twin("omarm_one");
  const std::vector<std::string> arm{"omarm_arm_controller"};
  ASSERT_TRUE(twin.robot().controller_manager().switch_controllers({}, arm, Strictness::strict).ok());
  twin.joint("Revolute 1").command(1.2);
  twin.run_for(2s);
  EXPECT_NEAR(twin.joint("Revolute 1").q(), 1.2, 0.01);
  EXPECT_NEAR(twin.joint("Revolute 1").v(), 0, 1e-3);
}

TEST(TwinFacade, UnknownAndMimicJointsAreRefused) {
  Twin twin("omarm_one");
  EXPECT_THROW(static_cast<void>(twin.joint("Revolute2")), InputError);
  EXPECT_THROW(twin.joint("Revolute 9").command(0.1), InputError);
  EXPECT_THROW(Twin("omarm_on"), InputError);
}

}  // namespace
}  // namespace doppel
