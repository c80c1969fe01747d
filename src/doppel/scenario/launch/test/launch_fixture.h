#pragma once
// A workspace with launch files for tests.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "doppel/scenario/launch/launch_plan.h"
#include "doppel/scenario/launch/read_launch.h"

namespace doppel {

inline constexpr const char* kArm =
    R"X(<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="length" default="1"/>
<link name="world"/><link name="upper"><inertial><mass value="$(arg length)"/><inertia ixx="1e-2" iyy="1e-2"
izz="1e-2" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="shoulder" type="revolute"><parent
link="world"/><child link="upper"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="9"
velocity="2"/></joint></robot>)X";

class LaunchFixture : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    workspace_ = std::filesystem::path(::testing::TempDir()) / "launch" / info->name();
    std::filesystem::remove_all(workspace_);
    std::filesystem::create_directories(workspace_ / "made");
    write("arm_description/package.xml", "<package format=\"3\"><name>arm_description</name></package>");
    write("arm_description/urdf/arm.urdf.xacro", kArm);
  }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = workspace_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
    return file;
  }
  // A launch file with the usual imports, whose description has these entities.
  [[nodiscard]] std::filesystem::path python(const std::string& entities,
                                             const std::string& before = "") const {
    return write("arm_description/launch/arm.launch.py",
                 "from launch import LaunchDescription\n"
                 "from launch.actions import *\n"
                 "from launch.conditions import *\n"
                 "from launch.event_handlers import *\n"
                 "from launch.launch_description_sources import *\n"
                 "from launch.substitutions import *\n"
                 "from launch_ros.actions import *\n"
                 "from launch_ros.parameter_descriptions import *\n"
                 "from launch_ros.substitutions import *\n" +
                     before + "\ndef generate_launch_description():\n  return LaunchDescription([" +
                     entities + "])\n");
  }

  LaunchDescription read(const std::filesystem::path& file, const NamedTexts& arguments = {}) {
    PackageResolver resolver;
    return read_launch(file, arguments, resolver, workspace_ / "made");
  }
  LaunchPlan plan(const std::filesystem::path& file, const NamedTexts& arguments = {}) {
    PackageResolver resolver;
    description_ = read_launch(file, arguments, resolver, workspace_ / "made");
    return plan_launch(description_, resolver, workspace_ / "made");
  }
  std::string error_of(const std::filesystem::path& file, const NamedTexts& arguments = {}) {
    try {
      static_cast<void>(read(file, arguments));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path workspace_;
  LaunchDescription description_;
};

}  // namespace doppel
