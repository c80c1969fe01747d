// Grasping in the twin: held by friction, why something slips, what is attached on request.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iostream>

#include "doppel/messages/diagnostic_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

using diagnostic_msgs::msg::DiagnosticArray;
using diagnostic_msgs::msg::DiagnosticStatus;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

// A hand on a vertical slide with two fingers of 5 N, 60 mm apart at 0; at lift 0 their tips are at z = 20 mm.
constexpr const char* kHand = R"(<robot name='hand'>
<link name='world'/>
<link name='palm'><inertial><mass value='0.2'/><inertia ixx='1e-4' ixy='0' ixz='0' iyy='1e-4' iyz='0' izz='1e-4'/></inertial></link>
<joint name='lift' type='prismatic'><origin xyz='0 0 0.1'/><parent link='world'/><child link='palm'/><axis xyz='0 0 1'/>
  <limit lower='0' upper='0.3' effort='50' velocity='0.2'/></joint>
FINGERS
PLUGINS
<ros2_control name='hand' type='system'><hardware><plugin>gz_ros2_control/GazeboSimSystem</plugin></hardware>
  <joint name='lift'><command_interface name='position'/><state_interface name='position'/></joint>
  <joint name='left'><command_interface name='position'/><state_interface name='position'/></joint>
  <joint name='right'><command_interface name='position'/><state_interface name='position'/></joint>
</ros2_control></robot>)";

std::string finger(const std::string& name, int side) {
  const std::string y = std::to_string(0.032 * side), axis = std::to_string(-side);
  return "<link name='" + name +
         "_finger'><inertial><origin xyz='0 0 -0.08'/><mass value='0.02'/><inertia ixx='5e-6' ixy='0' "
         "ixz='0' iyy='5e-6' "
         "iyz='0' izz='5e-6'/></inertial><collision><origin xyz='0 0 -0.08'/><geometry><box size='0.02 0.004 "
         "0.02'/></geometry></collision></link><joint name='" +
         name + "' type='prismatic'><origin xyz='0 " + y + " 0'/><parent link='palm'/><child link='" + name +
         "_finger'/><axis xyz='0 " + axis +
         " 0'/><limit lower='0' upper='0.03' effort='5' velocity='0.1'/></joint>"
         "<gazebo reference='" +
         name + "_finger'><mu1>1.5</mu1><mu2>1.5</mu2></gazebo>\n";
}

constexpr const char* kHandControllers = R"(
controller_manager:
  ros__parameters:
    update_rate: 100
    hand_controller: {type: forward_command_controller/ForwardCommandController}
hand_controller: {ros__parameters: {joints: [lift, left, right], interface_name: position}}
)";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  if (const std::size_t at = text.find(what); at != std::string::npos) text.replace(at, what.size(), by);
  return text;
}

class GraspTest : public TwinFixture {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(::testing::TempDir()) / "grasp" / info->name();
    std::filesystem::create_directories(folder_);
    log_.add_sink([this](const LogLine& line) {
      if (line.severity != Severity::note && line.origin == "grasp") warnings_ += line.text + "\n";
    });
  }
  void bring_up_hand(double cube_friction, const std::string& plugins = "",
                     const std::string& engine = kDefaultEngine) {
    std::ofstream(folder_ / "hand.urdf")
        << replaced(replaced(kHand, "FINGERS", finger("left", -1) + finger("right", 1)), "PLUGINS", plugins);
    std::ofstream(folder_ / "controllers.yaml") << kHandControllers;
    std::ofstream(folder_ / "world.sdf") << R"(<sdf version='1.9'><world name='lab'>
<include><uri>model://ground_plane</uri></include></world></sdf>)";
    Scenario scenario;
    scenario.robots = {{.target = folder_ / "hand.urdf", .controllers = folder_ / "controllers.yaml"}};
    scenario.world = folder_ / "world.sdf";
    scenario.engine = engine;
    bring_up(scenario);
    EXPECT_THAT(
        call("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
             "{name: cube, initial_pose: {position: {z: 0.015}}, xml: \"" + cube(cube_friction) + "\"}"),
        HasSubstr("success: true"));
    run(0.1);
  }
  static std::string cube(double friction) {
    const std::string mu = std::to_string(friction);
    return "<sdf version='1.9'><model name='cube'><link name='body'><inertial><mass>0.2</mass>"
           "<inertia><ixx>3e-5</ixx><iyy>3e-5</iyy><izz>3e-5</izz></inertia></inertial>"
           "<collision name='c'><geometry><box><size>0.03 0.03 0.03</size></box></geometry>"
           "<surface><friction><ode><mu>" +
           mu + "</mu><mu2>" + mu + "</mu2></ode></friction></surface></collision></link></model></sdf>";
  }
  void move_hand(double lift, double grip, double seconds) {
    const std::string fingers = std::to_string(grip);
    publish("/hand_controller/commands", "std_msgs/msg/Float64MultiArray",
            "{data: [" + std::to_string(lift) + ", " + fingers + ", " + fingers + "]}");
    run(seconds);
  }
  [[nodiscard]] Pose pose(const std::string& name) const { return twin_->engine().find(name)->base_pose(); }
  [[nodiscard]] double height() const { return pose("cube").translation().z(); }
  std::vector<DiagnosticStatus> grasps() {
    const auto messages = received<DiagnosticArray>("/doppel/grasps");
    EXPECT_THAT(messages, Not(IsEmpty()));
    return messages.empty() ? std::vector<DiagnosticStatus>{} : messages.back().status;
  }
  static std::string value(const DiagnosticStatus& status, const std::string& key) {
    for (const auto& entry : status.values) {
      if (entry.key == key) return entry.value;
    }
    return "none";
  }

  std::filesystem::path folder_;
  std::string warnings_;
};

// G1 of the specification, with a spawned cube in an SDF world.
TEST_F(GraspTest, CubeIsHeldForMinuteAndFallsWhenReleased) {
  bring_up_hand(0.8);
  listen("/doppel/grasps");
  run(0.2);
  EXPECT_THAT(grasps(), IsEmpty());
  move_hand(0, 0.03, 1.0);
  move_hand(0.15, 0.03, 2.0);
  ASSERT_GT(height(), 0.16);
  const double palm = twin_->robot().instance().q()[0], before = height() - palm;
  run(60.0);
  const double slip = before - (height() - twin_->robot().instance().q()[0]);
  std::cout << "slip of a minute: " << 1e3 * slip << " mm\n";
  EXPECT_LT(std::abs(slip), 1e-5);
  const std::vector<DiagnosticStatus> held = grasps();
  ASSERT_THAT(held, SizeIs(1));
  EXPECT_EQ(held[0].level, DiagnosticStatus::OK);
  EXPECT_EQ(held[0].name, "grasp: hand holds cube");
  EXPECT_EQ(value(held[0], "links"), "left_finger, right_finger");
  EXPECT_NEAR(std::stod(value(held[0], "force (N)")), 10.0, 0.1);
  EXPECT_NEAR(std::stod(value(held[0], "friction used (%)")), 100 * 0.2 * 9.8 / 8.0, 0.5);
  EXPECT_LT(std::stod(value(held[0], "slip (mm)")), 0.1);
  EXPECT_GT(std::stod(value(held[0], "held for (s)")), 60.0);
  EXPECT_EQ(warnings_, "");
  move_hand(0.15, 0.0, 1.0);
  EXPECT_LT(height(), 0.016);
  EXPECT_THAT(grasps(), IsEmpty());
}

TEST_F(GraspTest, CubeOfLowFrictionFallsAndCauseIsReported) {
  bring_up_hand(0.15);
  move_hand(0, 0.03, 1.0);
  move_hand(0.15, 0.03, 2.0);
  EXPECT_LT(height(), 0.03);
  EXPECT_THAT(
      warnings_,
      StartsWith("'cube' slips between left_finger, right_finger of 'hand': friction 0.15 x 10 N = 1.5"));
  EXPECT_THAT(warnings_, EndsWith(" N < weight 1.96 N\n")) << "expected one report";
}

}  // namespace
}  // namespace doppel::test
