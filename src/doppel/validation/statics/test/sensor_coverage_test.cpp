// Sensors of light that see the workspace of a small arm, and those that do not: turned away, hidden.
#include "doppel/validation/statics/sensor_coverage.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

namespace doppel {
namespace {

using testing::HasSubstr;

constexpr const char* kCamera = R"(
  <sensor name="eye" type="camera"><camera>
    <horizontal_fov>1.0</horizontal_fov>
    <image><width>320</width><height>240</height></image>
    <clip><near>0.05</near><far>10</far></clip>
  </camera></sensor>)";

std::string bar(const std::string& name) {
  constexpr const char* kShape =
      R"(<origin xyz="0 0 0.1"/><geometry><box size="0.04 0.04 0.18"/></geometry>)";
  return fmt::format(R"(<link name="{}">
    <inertial><mass value="0.5"/>
      <inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial>
    <visual>{}</visual><collision>{}</collision></link>)",
                     name, kShape, kShape);
}

std::string hinge(const std::string& name, const std::string& parent, const std::string& child, double z,
                  const std::string& axis) {
  return fmt::format(R"(<joint name="{}" type="revolute">
    <parent link="{}"/><child link="{}"/><origin xyz="0 0 {}"/><axis xyz="{}"/>
    <limit lower="-1.5" upper="1.5" effort="20" velocity="2"/></joint>)",
                     name, parent, child, z, axis);
}

std::string fixed(const std::string& name, const std::string& parent, const std::string& child,
                  const std::string& origin) {
  return fmt::format(
      R"(<joint name="{}" type="fixed"><parent link="{}"/><child link="{}"/><origin {}/></joint>)", name,
      parent, child, origin);
}

// An arm of three joints and 0.5 m, and a camera in a housing at (1.2, 0, 0.3) that looks at the arm, turned
// by `yaw`.
std::string robot_text(double yaw, const std::string& sensor = kCamera, const std::string& extra = "") {
  return R"(<robot name="watched"><link name="base_link"/>)" + bar("turn") + bar("upper") + bar("fore") +
         hinge("j1", "base_link", "turn", 0, "0 0 1") + hinge("j2", "turn", "upper", 0.2, "0 1 0") +
         hinge("j3", "upper", "fore", 0.2, "0 1 0") + R"(<link name="tip"/>)" +
         fixed("tip_joint", "fore", "tip", R"(xyz="0 0 0.2")") + R"(<link name="camera_link"><visual>)" +
         R"(<geometry><box size="0.04 0.04 0.04"/></geometry></visual></link>)" +
         fixed("mount", "base_link", "camera_link",
               fmt::format(R"(xyz="1.2 0 0.3" rpy="0 0 {}")", std::numbers::pi + yaw)) +
         extra + R"(<gazebo reference="camera_link">)" + sensor + "</gazebo></robot>";
}

std::string shield(double forward) {
  return R"(<link name="shield"><visual><geometry><box size="0.005 0.3 0.3"/></geometry></visual></link>)" +
         fixed("screw", "camera_link", "shield", fmt::format(R"(xyz="{} 0 0")", forward));
}

class SensorCoverage : public testing::Test {
 protected:
  CheckResult check(const std::string& robot, std::size_t threads = 2) {
    const std::filesystem::path file = folder_ / "watched.urdf";
    std::ofstream(file) << robot;
    Scenario scenario;
    scenario.robots = {{.target = file.string()}};
    if (!world_.empty()) {
      scenario.world = folder_ / "world.yaml";
      std::ofstream(*scenario.world) << world_;
    }
    const Subject subject = read_subject(scenario, {});
    EXPECT_TRUE(subject.refusal.empty());
    CheckContext context{subject, suite_};
    context.effort = Effort::quick;
    context.threads = threads;
    return check_sensor_coverage(context);
  }
  static double metric(const CheckResult& result, const std::string& name) {
    for (const Metric& one : result.metrics)
      if (one.name == name) return one.value;
    return -1;
  }
  void SetUp() override {
    std::filesystem::create_directories(folder_);
    WorkspaceBox& box = suite_.workspace.emplace();
    box.low = {-0.2, -0.3, 0.1};
    box.high = {0.2, 0.3, 0.5};
  }

  void TearDown() override { std::filesystem::remove_all(folder_); }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("doppel_sensor_coverage_" + std::to_string(getpid()));
  Suite suite_;
  std::string world_;  // its file; empty: none
};

TEST_F(SensorCoverage, CameraTowardsWorkspaceSeesMostOfIt) {
  const CheckResult result = check(robot_text(0));
  EXPECT_EQ(result.verdict, Verdict::not_judged) << result.summary;
  EXPECT_GT(metric(result, "workspace seen"), 70);
  EXPECT_GT(metric(result, "tool seen"), 50);
  EXPECT_GT(metric(result, "hidden by the robot"), 0.1);  // behind the arm
  // fx / z: 160 / tan(0.5 rad) / 1.2 m.
  EXPECT_NEAR(metric(result, "resolution"), 160 / std::tan(0.5) / 120, 0.5);
  suite_.min_seen = 0.7;
  EXPECT_EQ(check(robot_text(0)).verdict, Verdict::passed);
  suite_.min_seen = 0.99;
  EXPECT_EQ(check(robot_text(0)).verdict, Verdict::failed);
}

TEST_F(SensorCoverage, CameraTurnedAwayFailsWithItsAngle) {
  for (const double degrees : {90.0, 180.0}) {
    const CheckResult result = check(robot_text(degrees * std::numbers::pi / 180));
    EXPECT_EQ(result.verdict, Verdict::failed);
    EXPECT_EQ(metric(result, "workspace seen"), 0);
    ASSERT_EQ(result.items.size(), 1U);
    EXPECT_THAT(result.items[0].message, HasSubstr("sees 0 % of the workspace"));
    EXPECT_THAT(result.items[0].message, HasSubstr("turned away"));
    EXPECT_THAT(result.items[0].message, HasSubstr(fmt::format("{:.0f} deg from its axis", degrees)));
  }
}

TEST_F(SensorCoverage, CameraAlongAxesOfOpticalFrameIsExplained) {
  const std::string optical =
      R"(<link name="optical"/><joint name="optics" type="fixed"><parent link="camera_link"/>
<child link="optical"/><origin rpy="-1.5707963 0 -1.5707963"/></joint>)";
  std::string text = robot_text(0, kCamera, optical);
  text.replace(text.find(R"(<gazebo reference="camera_link">)"), 32, R"(<gazebo reference="optical">)");
  const CheckResult result = check(text);
  EXPECT_EQ(result.verdict, Verdict::failed);
  EXPECT_THAT(result.items.at(0).fix, HasSubstr("optical frame"));
}

TEST_F(SensorCoverage, LinkInFrontOfLensIsNamed) {
  const CheckResult result = check(robot_text(0, kCamera, shield(0.08)));
  EXPECT_EQ(result.verdict, Verdict::failed);
  EXPECT_THAT(result.items.at(0).message, HasSubstr("link 'shield' is in front of the lens"));
  EXPECT_THAT(result.items.at(0).poses.at(0).links, testing::Contains("shield"));
  // A part that is nearer than a picture begins hides, too; the housing around the lens does not.
  EXPECT_EQ(check(robot_text(0, kCamera, shield(0.03))).verdict, Verdict::failed);
  EXPECT_GT(metric(check(robot_text(0, kCamera, shield(-0.1))), "workspace seen"), 70);
}

TEST_F(SensorCoverage, ObjectOfWorldInFrontOfLensIsNamed) {
  const double alone = metric(check(robot_text(0)), "workspace seen");
  world_ = "objects:\n  - {name: crate, box: [0.02, 1, 1], xyz: [0.9, 0, 0.5]}\n";
  const CheckResult hidden = check(robot_text(0));
  EXPECT_EQ(hidden.verdict, Verdict::failed);
  EXPECT_THAT(hidden.items.at(0).message, HasSubstr("object 'crate' is in front of the lens"));
  EXPECT_THAT(hidden.items.at(0).poses.at(0).links, testing::Not(testing::Contains("crate")));
  EXPECT_GT(metric(hidden, "hidden by its world"), 70);
  EXPECT_EQ(metric(hidden, "hidden by the robot"), 0);
  world_ = "objects:\n  - {name: crate, box: [0.02, 1, 1], xyz: [-0.9, 0, 0.5]}\n";
  EXPECT_EQ(metric(check(robot_text(0)), "workspace seen"), alone);
}

TEST_F(SensorCoverage, PlacesBelowGroundAreHiddenByIt) {
  suite_.workspace->low.z() = -0.4;
  const CheckResult result = check(robot_text(0));
  EXPECT_GT(metric(result, "hidden by its world"), 10);
  EXPECT_THAT(result.items.at(0).message, HasSubstr("is hidden, mostly by the ground"));
}

TEST_F(SensorCoverage, WorkspaceBeyondRangeIsTooFar) {
  const std::string depth =
      R"(<sensor name="eye" type="depth_camera"><camera><horizontal_fov>1.0</horizontal_fov>
<clip><near>0.05</near><far>0.5</far></clip></camera></sensor>)";
  const CheckResult result = check(robot_text(0, depth));
  EXPECT_EQ(result.verdict, Verdict::failed);
  EXPECT_THAT(result.items.at(0).message, HasSubstr("too far; it sees from 0.05 to 0.5 m"));
}

// One ring sees the layer of places that it passes through.
TEST_F(SensorCoverage, ScanOfOnePlaneSeesOneLayer) {
  const std::string lidar =
      R"(<sensor name="scan" type="gpu_lidar"><lidar>
    <scan><horizontal><samples>360</samples>
      <min_angle>-1.57</min_angle><max_angle>1.57</max_angle></horizontal></scan>
    <range><min>0.05</min><max>5</max></range></lidar></sensor>)";
  const CheckResult result = check(robot_text(0, lidar));
  EXPECT_EQ(result.verdict, Verdict::not_judged);
  EXPECT_GT(metric(result, "workspace seen"), 50.0 / 9);
  EXPECT_LT(metric(result, "workspace seen"), 150.0 / 9);
}

TEST_F(SensorCoverage, ResultIsSameForAnyNumberOfThreads) {
  const CheckResult one = check(robot_text(0), 1), many = check(robot_text(0), 5);
  ASSERT_EQ(one.metrics.size(), many.metrics.size());
  for (std::size_t i = 0; i < one.metrics.size(); ++i) EXPECT_EQ(one.metrics[i].value, many.metrics[i].value);
  EXPECT_EQ(one.items.at(0).message, many.items.at(0).message);
}

TEST_F(SensorCoverage, RobotWithoutSensorsIsNotJudged) {
  EXPECT_EQ(check(robot_text(0, "")).verdict, Verdict::not_applicable);
}

TEST_F(SensorCoverage, CameraOfBundledArmSeesSomething) {
  Scenario scenario;
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  scenario.robots = {{.target = "lab_arm"}};
  const Subject subject = read_subject(scenario, {});
  const Suite suite;
  CheckContext context{subject, suite};
  context.effort = Effort::quick;
  const CheckResult result = check_sensor_coverage(context);
  EXPECT_EQ(result.verdict, Verdict::not_judged) << result.items.at(0).message;
  EXPECT_GT(metric(result, "workspace seen"), 0) << result.items.at(0).message;
}

}  // namespace
}  // namespace doppel
