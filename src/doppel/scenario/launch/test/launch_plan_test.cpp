// Launch files as scenarios and programs.
#include "doppel/scenario/launch/launch_plan.h"

#include <gmock/gmock.h>

#include "launch_fixture.h"

namespace doppel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;

constexpr const char* kDescribed =
    "rsp := Node(package='robot_state_publisher', executable='robot_state_publisher', "
    "parameters=[{'robot_description':\n"
    "  Command(['xacro ', PathJoinSubstitution([FindPackageShare('arm_description'), 'urdf', "
    "'arm.urdf.xacro'])])}]),\n";

class LaunchPlanTest : public LaunchFixture {
 protected:
  [[nodiscard]] std::string outcome_of(const std::string& executable) const {
    for (const LaunchRecord& record : description_.records) {
      if (record.executable == executable) return plan_.outcomes.at(record.id).text;
    }
    return "no such record";
  }
  void make(const std::filesystem::path& file, const NamedTexts& arguments = {}) {
    plan_ = plan(file, arguments);
  }
  LaunchPlan plan_;
};

TEST_F(LaunchPlanTest, DisplayIsShownWithoutPhysics) {
  make(python(std::string(kDescribed) +
              "Node(package='joint_state_publisher_gui', executable='joint_state_publisher_gui'),\n"
              "Node(package='rviz2', executable='rviz2')"));
  EXPECT_FALSE(plan_.physics);
  ASSERT_THAT(plan_.scenario.robots, SizeIs(1));
  EXPECT_EQ(plan_.scenario.robots[0].target, (workspace_ / "arm_description/urdf/arm.urdf.xacro").string());
  EXPECT_EQ(outcome_of("joint_state_publisher_gui"), "the page has the sliders");
}

TEST_F(LaunchPlanTest, GazeboSpawnAndSpawnersBecomePoseAndControllers) {
  write("arm_description/worlds/room.sdf", "<sdf version=\"1.9\"><world name=\"room\"/></sdf>");
  make(python(std::string(kDescribed) +
              "IncludeLaunchDescription(PythonLaunchDescriptionSource([FindPackageShare('ros_gz_sim'), "
              "'/launch/gz_sim.launch.py']), launch_arguments={'gz_args': ['-r -v 4 ', "
              "FindPackageShare('arm_description'), '/worlds/room.sdf']}.items()),\n"
              "TimerAction(period=5.0, actions=[Node(package='ros_gz_sim', executable='create', arguments=["
              "'-topic', 'robot_description', '-name', 'arm', '-z', '0.5', '-Y', '1.5'])]),\n"
              "TimerAction(period=8.0, actions=[ExecuteProcess(cmd=['ros2', 'control', 'load_controller', "
              "'--set-state', 'active', 'joint_state_broadcaster'])]),\n"
              "Node(package='controller_manager', executable='spawner', arguments=['arm_controller', '-c', "
              "'/controller_manager'])"));
  EXPECT_TRUE(plan_.physics);
  const WorldRobot& robot = plan_.scenario.robots.at(0);
  ASSERT_TRUE(robot.X_WR);
  EXPECT_DOUBLE_EQ(robot.X_WR->translation().z(), 0.5);
  EXPECT_NEAR(robot.X_WR->linear()(1, 0), std::sin(1.5), 1e-12);
  EXPECT_THAT(robot.activate, ElementsAre("joint_state_broadcaster", "arm_controller"));
  EXPECT_TRUE(robot.tolerant);
  EXPECT_EQ(plan_.scenario.world, workspace_ / "arm_description/worlds/room.sdf");
  EXPECT_FALSE(plan_.scenario.wall_stamps) << "Gazebo publishes /clock";
  EXPECT_TRUE(plan_.scenario.start_controllers);
}

TEST_F(LaunchPlanTest, ControlNodeHasFilesValuesNamespaceAndRemappings) {
  const auto file = write("arm_description/config/c.yaml",
                          "controller_manager:\n  ros__parameters:\n    update_rate: 50\n");
  make(python(
      "GroupAction([PushRosNamespace('left'),\n" + std::string(kDescribed).replace(0, 7, "") +
      "Node(package='controller_manager', executable='ros2_control_node', parameters=[[FindPackageShare("
      "'arm_description'), '/config/c.yaml'], {'update_rate': 100}], remappings=[('~/a', '/b'), "
      "('~/robot_description', '/left/robot_description')]),\n"
      "Node(package='controller_manager', executable='spawner', arguments=['one', '--inactive']),\n"
      "Node(package='controller_manager', executable='spawner', arguments=['two'])])"));
  const WorldRobot& robot = plan_.scenario.robots.at(0);
  EXPECT_EQ(robot.name_space, "left");
  ASSERT_THAT(robot.controllers, SizeIs(2));
  EXPECT_EQ(robot.controllers[0], std::filesystem::canonical(file));
  EXPECT_THAT(robot.activate, ElementsAre("two"));
  EXPECT_THAT(plan_.scenario.ros.names.texts(), ElementsAre("~/a:=/b"));
  EXPECT_TRUE(plan_.scenario.wall_stamps) << "without Gazebo, nodes have the system's time";
}

TEST_F(LaunchPlanTest, SpawnersFileIsThatOfManagerWithSubstitutions) {
  write("arm_description/config/c.yaml",
        "controller_manager:\n  ros__parameters:\n    update_rate: $(var rate)\n");
  make(python("DeclareLaunchArgument('rate', default_value='50'),\n" + std::string(kDescribed) +
              "Node(package='controller_manager', executable='ros2_control_node', parameters=[ParameterFile("
              "[FindPackageShare('arm_description'), '/config/c.yaml'], allow_substs=True)]),\n"
              "Node(package='controller_manager', executable='spawner', arguments=['one', '--param-file', "
              "[FindPackageShare('arm_description'), '/config/c.yaml']])"));
  EXPECT_THAT(plan_.scenario.robots.at(0).controllers, ElementsAre(workspace_ / "made/c.yaml"));
}

TEST_F(LaunchPlanTest, RobotWithoutSpawnersHasNoControllers) {
  make(python(std::string(kDescribed) +
              "Node(package='ros_gz_sim', executable='create', arguments=['-topic', 'robot_description'])"));
  EXPECT_FALSE(plan_.scenario.start_controllers);
}

TEST_F(LaunchPlanTest, SpawnedModelFilesBecomePartOfWorld) {
  write("arm_description/models/box/model.sdf", "<sdf version=\"1.9\"><model name=\"box\"/></sdf>");
  make(python(
      std::string(kDescribed) +
      "Node(package='gazebo_ros', executable='spawn_entity.py', arguments=['-entity', 'crate', '-file', "
      "[FindPackageShare('arm_description'), '/models/box/model.sdf'], '-x', '2']),\n"
      "Node(package='gazebo_ros', executable='spawn_entity.py', arguments=['-topic', "
      "'/robot_description'])"));
  ASSERT_TRUE(plan_.scenario.world);
  std::ifstream in(*plan_.scenario.world);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_THAT(text, HasSubstr("<name>crate</name><pose>2 0 0"));
  EXPECT_THAT(text, HasSubstr("ground_plane"));
  EXPECT_THAT(plan_.scenario.robots, SizeIs(1)) << "the robot is spawned as well";
}

TEST_F(LaunchPlanTest, StaticTransformsAreThoseOfBothStyles) {
  make(python(
      std::string(kDescribed) +
      "Node(package='tf2_ros', executable='static_transform_publisher', arguments=['1', '2', '3', '0.5', "
      "'0', "
      "'0', 'map', 'odom']),\n"
      "Node(package='tf2_ros', executable='static_transform_publisher', arguments=['--x', '4', '--yaw', "
      "'0.25', '--frame-id', 'odom', '--child-frame-id', 'base'])"));
  ASSERT_THAT(plan_.scenario.transforms, SizeIs(2));
  const StaticTransform& first = plan_.scenario.transforms[0];
  EXPECT_EQ(first.parent + first.child, "mapodom");
  EXPECT_NEAR(first.X_PC.linear()(1, 0), std::sin(0.5), 1e-12) << "yaw comes first";
  EXPECT_EQ(plan_.scenario.transforms[1].X_PC.translation().x(), 4);
}

TEST_F(LaunchPlanTest, OwnNodesAreProgramsInTheirOrder) {
  const auto script = write("arm_description/scripts/mimic.py", "#!/usr/bin/env python3\n");
  std::filesystem::permissions(script, std::filesystem::perms::owner_all);
  make(python(
      std::string(kDescribed) +
      "one := Node(package='arm_description', executable='mimic.py', name='m', parameters=[{'gain': 2.0}]),\n"
      "RegisterEventHandler(OnProcessExit(target_action=one, on_exit=[ExecuteProcess(cmd=['true'])])),\n"
      "ExecuteProcess(cmd=['ros2', 'topic', 'pub', '/a', 'std_msgs/msg/Empty', '{}']),\n"
      "Node(package='arm_description', executable='not_built'),\n"
      "Node(package='foreign', executable='e')"));
  ASSERT_THAT(plan_.programs, SizeIs(3));
  EXPECT_EQ(plan_.programs[0].words[0], script.string());
  EXPECT_EQ(plan_.programs[0].label, "m");
  EXPECT_THAT(plan_.programs[0].words, testing::Contains("__node:=m"));
  EXPECT_EQ(plan_.programs[1].after, plan_.programs[0].record);
  EXPECT_THAT(plan_.programs[2].words,
              ElementsAre("doppel", "topic", "pub", "/a", "std_msgs/msg/Empty", "{}"));
  EXPECT_THAT(outcome_of("not_built"), HasSubstr("is not built"));
  EXPECT_THAT(outcome_of("e"), HasSubstr("the package 'foreign' is not on this machine"));
}

TEST_F(LaunchPlanTest, PlannersAreNamedAsNotHere) {
  make(python(std::string(kDescribed) + "Node(package='moveit_ros_move_group', executable='move_group'),\n"
                                        "Node(package='nav2_controller', executable='controller_server')"));
  EXPECT_THAT(outcome_of("move_group"), HasSubstr("not here"));
  EXPECT_THAT(outcome_of("controller_server"), HasSubstr("not here"));
  EXPECT_THAT(plan_.programs, IsEmpty());
}

TEST_F(LaunchPlanTest, RoslaunchWithTwoModelsHasBoth) {
  write("arm_description/urdf/table.urdf",
        "<robot name=\"table\"><link name=\"top\"><inertial><mass value=\"5\"/><inertia ixx=\"1\" iyy=\"1\" "
        "izz=\"1\""
        " ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link></robot>");
  make(write("arm_description/launch/arm.launch", R"X(<launch>
  <param name="robot_description"
   command="$(find xacro)/xacro.py $(find arm_description)/urdf/arm.urdf.xacro"/>
  <param name="table_description" textfile="$(find arm_description)/urdf/table.urdf"/>
  <node name="a" pkg="gazebo_ros" type="spawn_model" args="-urdf -param robot_description -model arm -z 1"/>
  <node name="t" pkg="gazebo" type="spawn_model"
   args="-urdf -param table_description -z 0.01 -model table_model"/>
</launch>)X"));
  ASSERT_THAT(plan_.scenario.robots, SizeIs(2));
  EXPECT_EQ(plan_.scenario.robots[0].X_WR->translation().z(), 1);
  EXPECT_EQ(plan_.scenario.robots[1].name_space, "table_model");
  EXPECT_EQ(plan_.scenario.robots[1].X_WR->translation().z(), 0.01);
}

TEST_F(LaunchPlanTest, MadeDescriptionsAreWrittenAsFiles) {
  make(
      python("Node(package='robot_state_publisher', executable='robot_state_publisher', parameters=[{"
             "'robot_description': '<robot name=\"made\"><link name=\"a\"/></robot>'}])"));
  EXPECT_EQ(plan_.scenario.robots.at(0).target, (workspace_ / "made/robot.urdf").string());
}

TEST_F(LaunchPlanTest, FileThatCannotBeWrittenIsError) {
  const auto file = python(
      "Node(package='robot_state_publisher', executable='robot_state_publisher', parameters=[{"
      "'robot_description': '<robot name=\"made\"><link name=\"a\"/></robot>'}])");
  description_ = read(file);
  std::filesystem::remove_all(workspace_ / "made");
  PackageResolver resolver;
  EXPECT_THROW(plan_launch(description_, resolver, workspace_ / "made"), InputError);
}

TEST_F(LaunchPlanTest, TreeHasOneLinePerRecord) {
  make(python(std::string(kDescribed) +
              "TimerAction(period=2.0, actions=[Node(package='rviz2', executable='rviz2')])"));
  const std::string tree = launch_tree(description_, plan_, workspace_ / "arm_description/launch");
  EXPECT_THAT(tree,
              HasSubstr("+ robot_state_publisher robot_state_publisher  arm.launch.py:12  the robot\n"));
  EXPECT_THAT(tree, HasSubstr("+   rviz2 rviz2"));
}

}  // namespace
}  // namespace doppel
