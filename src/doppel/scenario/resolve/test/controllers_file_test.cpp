#include "doppel/scenario/resolve/controllers_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace doppel {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

ControllersFile read(const std::string& yaml) {
  return controllers_in(ParameterFile::parse(yaml, "c.yaml"));
}

TEST(ControllersFileTest, ControllersHaveTypePlaceAndParameters) {
  const ControllersFile file = read(
      "controller_manager:\n  ros__parameters:\n    update_rate: 50\n    arm: {type: a/B}\n"
      "arm:\n  ros__parameters:\n    joints: [one, two]\n");
  EXPECT_TRUE(file.for_ros2);
  EXPECT_EQ(file.update_rate, 50);
  ASSERT_THAT(file.controllers, SizeIs(1));
  EXPECT_EQ(file.controllers[0].type, "a/B");
  EXPECT_EQ(file.controllers[0].where.line, 4);
  EXPECT_THAT(file.controllers[0].driven_joints(), ElementsAre("one", "two"));
}

TEST(ControllersFileTest, NamespacedAndWildcardManagersDeclareControllers) {
  for (const char* manager : {"/left/controller_manager", "/**/controller_manager"}) {
    const std::string arm = std::string(manager).substr(0, std::string(manager).rfind('/')) + "/arm";
    const ControllersFile file = read(std::string(manager) + ":\n  ros__parameters:\n    arm: {type: a/B}\n" +
                                      arm + ":\n  ros__parameters:\n    left_wheel_names: [w]\n");
    EXPECT_TRUE(file.for_ros2) << manager;
    ASSERT_THAT(file.controllers, SizeIs(1)) << manager;
    EXPECT_THAT(file.controllers[0].named_joints(), ElementsAre("w")) << manager;
  }
}

TEST(ControllersFileTest, ManagerParameterGroupsAreNoControllers) {
  EXPECT_THAT(read("controller_manager:\n  ros__parameters:\n    overruns: {manage: true}\n").controllers,
              IsEmpty());
}

TEST(ControllersFileTest, UndeclaredSectionIsKeptWithPlace) {
  const ControllersFile file = read(
      "controller_manager:\n  ros__parameters:\n    arm: {type: a/B}\n"
      "amr:\n  ros__parameters:\n    joints: [x]\n");
  ASSERT_THAT(file.other_sections, SizeIs(1));
  EXPECT_EQ(file.other_sections[0].first, "amr");
  EXPECT_EQ(file.other_sections[0].second.line, 6);
}

TEST(ControllersFileTest, FileForOtherNodesIsNoControllersFile) {
  EXPECT_FALSE(read("robot_state_publisher:\n  ros__parameters:\n    publish_frequency: 20.0\n").for_ros2);
}

}  // namespace
}  // namespace doppel
