#include "doppel/scenario/schema/robot_text.h"

#include <gtest/gtest.h>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

TEST(RobotText, TargetAloneHasDefaults) {
  const WorldRobot robot = parse_robot("omarm_one");
  EXPECT_EQ(robot.target, "omarm_one");
  EXPECT_EQ(robot.name_space, "");
  EXPECT_FALSE(robot.X_WR);
}

TEST(RobotText, NamespaceAndPlaceAreRead) {
  const WorldRobot robot = parse_robot("arms/my.urdf:fleet/right@0.8,-1,0.5,0,0,1.5707963267948966");
  EXPECT_EQ(robot.target, "arms/my.urdf");
  EXPECT_EQ(robot.name_space, "fleet/right");
  ASSERT_TRUE(robot.X_WR);
  EXPECT_TRUE(robot.X_WR->translation().isApprox(Eigen::Vector3d(0.8, -1, 0.5)));
  EXPECT_TRUE((robot.X_WR->linear() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
}

TEST(RobotText, PlaceAloneLeavesNamespaceEmpty) {
  const WorldRobot robot = parse_robot("lab_arm@1,2,3");
  EXPECT_EQ(robot.name_space, "");
  EXPECT_TRUE(robot.X_WR->translation().isApprox(Eigen::Vector3d(1, 2, 3)));
}

TEST(RobotText, InvalidTextIsRefused) {
  for (const char* text : {"omarm_one:", "omarm_one:2nd", "omarm_one:a-b", "omarm_one@1,2", "omarm_one@1,2,x",
                           "omarm_one@1,2,3,", "@1,2,3", "omarm_one@1,2,3,4,5,6,7", "omarm_one@nan,0,0"}) {
    EXPECT_THROW(static_cast<void>(parse_robot(text)), InputError) << text;
  }
}

}  // namespace
}  // namespace doppel
