#include "doppel/scenario/resolve/controllers_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "doppel/scenario/resolve/side_files.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// A workspace with the package of an arm, to which tests add files.
class ControllersSearchTest : public ::testing::Test {
 protected:
  ControllersSearchTest()
      : src_(fs::temp_directory_path() / ("doppel_choice_" + std::to_string(::getpid()))) {
    package("arm_description");
    robot_.name = "arm";
    for (const char* name : {"shoulder", "elbow"}) robot_.joints.emplace_back().name = name;
    target_ = {src_ / "arm_description/urdf/arm.urdf", src_ / "arm_description"};
  }
  ~ControllersSearchTest() override { fs::remove_all(src_); }

  void write(const std::string& file, const std::string& text) {
    fs::create_directories((src_ / file).parent_path());
    std::ofstream(src_ / file) << text;
  }
  void package(const std::string& name) {
    write(name + "/package.xml", "<package format=\"3\"><name>" + name + "</name></package>");
  }
  static std::string yaml(const std::string& joints, const std::string& parameter = "joints") {
    return "controller_manager:\n  ros__parameters:\n    update_rate: 50\n    c: {type: a/B}\nc:\n"
           "  ros__parameters:\n    " +
           parameter + ": [" + joints + "]\n";
  }
  // The chosen file, relative to the workspace; "" if there is none.
  std::string chosen() {
    diagnostics_ = {};
    found_ = find_controllers_files(robot_, target_, PackageResolver());
    report(found_, diagnostics_);
    return found_.files.empty() ? "" : found_.files.front().path.lexically_relative(src_).string();
  }
  [[nodiscard]] std::string said(const std::string& rule) const {
    for (const Diagnostic& d : diagnostics_.all()) {
      if (d.rule == rule) return d.message;
    }
    return "";
  }
  void plugin(const std::string& file) {
    robot_.gazebo.emplace_back().plugins.emplace_back().parameter_files = {file};
  }

  fs::path src_;
  RobotDescription robot_;
  Target target_;
  ControllersSearch found_;
  Diagnostics diagnostics_;
};

TEST_F(ControllersSearchTest, FileOfOtherRobotIsNotTaken) {
  package("rover");
  for (const char* file : {"rover/config/a.yaml", "rover/config/b.yaml"})
    write(file, yaml("left_wheel_joint", "left_wheel_names"));
  EXPECT_EQ(chosen(), "");
  EXPECT_THAT(said("up.controllers_of_others"), HasSubstr("'left_wheel_joint' is not a joint here"));
  EXPECT_FALSE(diagnostics_.has_errors());
}

TEST_F(ControllersSearchTest, FileWithoutItsInterfaceIsNotedApartFromThoseOfOtherRobots) {
  HardwareJointDescription& shoulder = robot_.hardware.emplace_back().joints.emplace_back();
  shoulder.name = "shoulder";
  shoulder.command_interfaces.emplace_back().name = "position";
  write("arm_description/config/velocity.yaml",
        "controller_manager:\n  ros__parameters:\n"
        "    c: {type: velocity_controllers/JointGroupVelocityController}\n"
        "c:\n  ros__parameters:\n    joints: [shoulder]\n");
  package("rover");
  write("rover/config/a.yaml", yaml("wheel"));
  EXPECT_EQ(chosen(), "");
  std::vector<std::string> notes;
  for (const Diagnostic& d : diagnostics_.all()) {
    if (d.rule == "up.controllers_of_others") notes.push_back(d.message);
  }
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_THAT(notes[0], HasSubstr("1 file with controllers of this robot is ignored"));
  EXPECT_THAT(notes[0], HasSubstr("no command interface 'shoulder/velocity'"));
  EXPECT_THAT(notes[0], HasSubstr("velocity.yaml"));
  EXPECT_THAT(notes[1], HasSubstr("'wheel' is not a joint here"));
  EXPECT_THAT(notes[1], HasSubstr("a.yaml"));
}

TEST_F(ControllersSearchTest, FileOfRos1WithBaseIsTakenWhereThereIsNoneOfRos2) {
  package("arm_control");
  write("arm_control/config/control.yaml",
        "base:\n  type: diff_drive_controller/DiffDriveController\n  left_wheel: shoulder\n  right_wheel: "
        "elbow\n");
  EXPECT_EQ(chosen(), "arm_control/config/control.yaml");
  write("arm_control/config/ros2.yaml", yaml("shoulder"));
  EXPECT_EQ(chosen(), "arm_control/config/ros2.yaml");
  EXPECT_THAT(said("up.controllers_chosen"), HasSubstr("it is of ROS 2"));
}

TEST_F(ControllersSearchTest, FileWithMostJointsIsTaken) {
  write("arm_description/config/controllers.yaml", yaml("shoulder"));
  write("arm_description/config/other.yaml", yaml("shoulder, elbow"));
  EXPECT_EQ(chosen(), "arm_description/config/other.yaml");
  EXPECT_THAT(said("up.controllers_chosen"), HasSubstr("lists most of the robot's joints"));
}

TEST_F(ControllersSearchTest, TieGoesToFewerForeignJoints) {
  write("arm_description/config/controllers.yaml", yaml("shoulder, elbow, finger"));
  write("arm_description/config/other.yaml", yaml("shoulder, elbow"));
  EXPECT_EQ(chosen(), "arm_description/config/other.yaml");
}

TEST_F(ControllersSearchTest, TieGoesToLaunchedThenUsualFile) {
  write("arm_description/config/a.yaml", yaml("shoulder"));
  write("arm_description/config/ros2_controllers.yaml", yaml("shoulder"));
  EXPECT_EQ(chosen(), "arm_description/config/ros2_controllers.yaml");
  EXPECT_THAT(said("up.controllers_chosen"), HasSubstr("the usual one"));
  write("arm_description/launch/up.launch.py", "parameters=['config/a.yaml']");
  EXPECT_EQ(chosen(), "arm_description/config/a.yaml");
}

TEST_F(ControllersSearchTest, PathWithRobotNameIsTaken) {
  package("b_moveit_config");
  package("x_arm_config");
  write("b_moveit_config/config/ros2_controllers.yaml", yaml("shoulder"));
  write("x_arm_config/config/ros2_controllers.yaml", yaml("shoulder"));
  EXPECT_EQ(chosen(), "x_arm_config/config/ros2_controllers.yaml");
}

TEST_F(ControllersSearchTest, TieGoesToPathWithMostNameWords) {
  robot_.name = "cr5_robot";
  for (const char* name : {"cr10_moveit", "cr3_moveit", "cr5_moveit"}) {
    package(name);
    write(std::string(name) + "/config/ros2_controllers.yaml", yaml("shoulder, elbow"));
  }
  EXPECT_EQ(chosen(), "cr5_moveit/config/ros2_controllers.yaml");
  EXPECT_THAT(said("up.controllers_chosen"), HasSubstr("has the most words in common with the robot's name"));
  robot_.name = "arm_robot";
  target_.description = src_ / "arm_description/urdf/CR3.urdf.xacro";
  EXPECT_EQ(chosen(), "cr3_moveit/config/ros2_controllers.yaml")
      << "expected the choice by the description's file";
}

TEST_F(ControllersSearchTest, PackageSearchIsBoundedTo200) {
  for (int i = 0; i < 200; ++i) package("a" + std::to_string(1000 + i));
  package("z_arm_config");
  write("z_arm_config/config/ros2_controllers.yaml", yaml("shoulder, elbow"));
  EXPECT_EQ(chosen(), "");
}

TEST_F(ControllersSearchTest, LastOfHundredFilesIsFound) {
  for (int i = 100; i < 200; ++i)
    write("arm_description/config/calibration_" + std::to_string(i) + ".yaml", "a: 1\n");
  write("arm_description/config/ros2_controllers.yaml", yaml("shoulder"));
  EXPECT_EQ(chosen(), "arm_description/config/ros2_controllers.yaml");
}

TEST_F(ControllersSearchTest, UnreadableFileOfOtherPackageIsNotReported) {
  package("other");
  write("other/config/map.yaml", std::string(kMaxSideFileBytes + 1, ' '));
  EXPECT_EQ(chosen(), "");
  EXPECT_TRUE(diagnostics_.all().empty());
}

TEST_F(ControllersSearchTest, OwnPackageIsPreferred) {
  package("arm_bringup");
  write("arm_bringup/config/controllers.yaml", yaml("shoulder, elbow"));
  EXPECT_EQ(chosen(), "arm_bringup/config/controllers.yaml");
  write("arm_description/config/sub/some.yaml", yaml("shoulder"));
  EXPECT_EQ(chosen(), "arm_description/config/sub/some.yaml");
}

TEST_F(ControllersSearchTest, ControllersOfRos1AreNotControllersFiles) {
  write("arm_description/config/controllers.yaml",
        "joint_state_controller:\n  type: joint_state_controller/JointStateController\n"
        "arm:\n  type: position_controllers/JointTrajectoryController\n  joints: [shoulder]\n");
  EXPECT_EQ(chosen(), "");
  EXPECT_TRUE(diagnostics_.all().empty());
}

TEST_F(ControllersSearchTest, UnreadableFileIsWarningWithPlace) {
  write("arm_description/config/controllers.yaml", yaml("shoulder") + "\tbroken: [\n");
  EXPECT_EQ(chosen(), "");
  ASSERT_EQ(diagnostics_.all().size(), 1U);
  EXPECT_EQ(diagnostics_.all().front().severity, Severity::warning);
  EXPECT_GT(diagnostics_.all().front().where.line, 0);
}

TEST_F(ControllersSearchTest, InvalidUpdateRateMakesFileUnusable) {
  std::string text = yaml("shoulder");
  text.replace(text.find("50"), 2, "fast");
  write("arm_description/config/controllers.yaml", text);
  EXPECT_EQ(chosen(), "");
  EXPECT_THAT(said("up.controllers_unreadable"), HasSubstr("update_rate"));
}

TEST_F(ControllersSearchTest, InvalidManagerParameterMakesFileUnusable) {
  std::string text = yaml("shoulder");
  text.replace(text.find("update_rate: 50"), 15, "enforce_command_limits: 3");
  write("arm_description/config/controllers.yaml", text);
  EXPECT_EQ(chosen(), "");
  EXPECT_THAT(said("up.controllers_unreadable"), HasSubstr("enforce_command_limits"));
}

TEST_F(ControllersSearchTest, WildcardSectionDeclaresControllers) {
  write("arm_description/config/controllers.yaml",
        "/**:\n  controller_manager:\n    ros__parameters:\n      c: {type: a/B}\n"
        "/**:\n  c:\n    ros__parameters:\n      joints: [shoulder]\n");
  EXPECT_EQ(chosen(), "arm_description/config/controllers.yaml");
}

TEST_F(ControllersSearchTest, FileOfPluginIsPreferred) {
  write("arm_description/config/a.yaml", yaml("shoulder, elbow"));
  write("arm_description/config/b.yaml", yaml("shoulder"));
  plugin((src_ / "arm_description/config/b.yaml").string());
  EXPECT_EQ(chosen(), "arm_description/config/b.yaml");
}

TEST_F(ControllersSearchTest, MissingPluginFileIsWarningAndSearchContinues) {
  write("arm_description/config/a.yaml", yaml("shoulder"));
  plugin("/no/such.yaml");
  EXPECT_EQ(chosen(), "arm_description/config/a.yaml");
  EXPECT_THAT(said("up.controllers_missing"), HasSubstr("/no/such.yaml"));
}

TEST_F(ControllersSearchTest, FindInPlainUrdfResolvesToPackage) {
  write("arm_description/config/b.yaml", yaml("shoulder"));
  plugin("$(find arm_description)/config/b.yaml");
  PackageResolver resolver;
  resolver.add_package("arm_description", src_ / "arm_description");
  const ControllersSearch found = find_controllers_files(robot_, target_, resolver);
  ASSERT_EQ(found.files.size(), 1U);
  EXPECT_TRUE(found.files.front().named);
  EXPECT_EQ(found.files.front().path, src_ / "arm_description/config/b.yaml");
  EXPECT_TRUE(found.missing.empty());
}

TEST_F(ControllersSearchTest, MissingPluginFileIsReportedWithNearest) {
  write("arm_description/config/controllers.yaml", yaml("shoulder"));
  plugin((src_ / "arm_description/config/controlers.yaml").string());
  EXPECT_EQ(chosen(), "arm_description/config/controllers.yaml");
  EXPECT_THAT(said("up.controllers_missing"), HasSubstr("did you mean 'controllers.yaml'?"));
}

TEST_F(ControllersSearchTest, OnlyFileWithOtherJointsIsKnown) {
  write("arm_description/config/controllers.yaml", yaml("shoulderr"));
  EXPECT_EQ(chosen(), "");
  ASSERT_TRUE(found_.of_another.has_value());
  EXPECT_EQ(found_.of_another->path, src_ / "arm_description/config/controllers.yaml");
}

}  // namespace
}  // namespace doppel
