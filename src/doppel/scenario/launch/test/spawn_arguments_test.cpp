// The command lines of spawners.
#include "doppel/scenario/launch/detail/spawn_arguments.h"

#include <gmock/gmock.h>

namespace doppel {
namespace {

using testing::ElementsAre;

TEST(SpawnArguments, NegativeCoordinatesAreValues) {
  const ModelSpawn spawn = model_spawn({"-topic", "d", "-x", "-1.5", "-Y", "-0.5", "-entity", "robot"});
  EXPECT_EQ(spawn.topic, "d");
  EXPECT_EQ(spawn.name, "robot");
  ASSERT_TRUE(spawn.X_WR);
  EXPECT_EQ(spawn.X_WR->translation().x(), -1.5);
  EXPECT_NEAR(spawn.X_WR->linear()(1, 0), std::sin(-0.5), 1e-12);
  EXPECT_FALSE(model_spawn(std::vector<std::string>{"-topic", "d"}).X_WR);
}

TEST(SpawnArguments, ControllersManagerAndFilesAreRead) {
  const ControllerSpawn spawn =
      controller_spawn({"a", "b", "--controller-manager-timeout", "30", "-p", "f.yaml", "-c",
                        "/left/controller_manager", "--inactive", "--ros-args", "-r", "x:=y"});
  EXPECT_THAT(spawn.names, ElementsAre("a", "b"));
  EXPECT_THAT(spawn.files, ElementsAre("f.yaml"));
  EXPECT_EQ(spawn.manager, "/left/controller_manager");
  EXPECT_FALSE(spawn.active);
}

TEST(SpawnArguments, WorldIsFoundAmongOptions) {
  EXPECT_EQ(world_of_command(split_words("-r -v 4 room.sdf")), "room.sdf");
  EXPECT_EQ(world_of_command(split_words("-r room.sdf -v4 --physics-engine gz-physics-bullet")), "room.sdf");
  EXPECT_EQ(world_of_command(split_words("sim -s -r room.sdf")), "room.sdf");
  EXPECT_EQ(
      world_of_command(split_words("--verbose -s libgazebo_ros_init.so -s libgazebo_ros_factory.so a.world")),
      "a.world");
  EXPECT_EQ(world_of_command(split_words("-r -s")), "");
}

TEST(SpawnArguments, TransformsWithQuaternionsAreNormalised) {
  const auto transform = static_transform({"0", "0", "0", "0", "0", "2", "2", "a", "b"});
  ASSERT_TRUE(transform);
  EXPECT_NEAR(transform->X_PC.linear()(1, 0), 1, 1e-12);
  EXPECT_FALSE(static_transform({"0", "0", "a", "b"}));
  EXPECT_FALSE(static_transform({"--x", "1", "--frame-id", "a"}));
}

}  // namespace
}  // namespace doppel
