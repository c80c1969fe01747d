#include "doppel/scenario/schema/command_kind.h"

#include <gtest/gtest.h>

namespace doppel {
namespace {

TEST(CommandKindTest, TypesOfRos2ControllersHaveTheirKinds) {
  EXPECT_EQ(command_kind("joint_trajectory_controller/JointTrajectoryController"), CommandKind::trajectory);
  EXPECT_EQ(command_kind("position_controllers/GripperActionController"), CommandKind::gripper);
  EXPECT_EQ(command_kind("parallel_gripper_action_controller/GripperActionController"), CommandKind::gripper);
  EXPECT_EQ(command_kind("forward_command_controller/ForwardCommandController"), CommandKind::forward);
  EXPECT_EQ(command_kind("effort_controllers/JointGroupEffortController"), CommandKind::forward);
}

TEST(CommandKindTest, OtherTypesTakeNoSuchCommands) {
  EXPECT_EQ(command_kind("forward_command_controller/MultiInterfaceForwardCommandController"),
            CommandKind::none);
  EXPECT_EQ(command_kind("joint_state_broadcaster/JointStateBroadcaster"), CommandKind::none);
  EXPECT_EQ(command_kind("pid_controller/PidController"), CommandKind::none);
  EXPECT_EQ(command_kind(""), CommandKind::none);
}

}  // namespace
}  // namespace doppel
