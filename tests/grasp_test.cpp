// Grasping in the twin: held by friction, why something slips, what is attached on request.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
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
    folder_ = make_folder("grasp");
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
    scenario.robots = {{.target = folder_ / "hand.urdf", .controllers = {folder_ / "controllers.yaml"}}};
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

// A block too heavy to be lifted, along which the fingers move up at 5 mm/s.
TEST_F(GraspTest, SlowSlipIsLoggedOnce) {
  bring_up_hand(0.3);
  call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: cube}");
  EXPECT_THAT(call("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
                   "{name: block, initial_pose: {position: {z: 0.015}}, xml: \"" +
                       replaced(cube(0.3), "<mass>0.2", "<mass>50") + "\"}"),
              HasSubstr("success: true"));
  move_hand(0, 0.03, 1.0);
  for (int i = 0; i < 100; ++i) move_hand(1e-4 * i, 0.03, 0.02);
  EXPECT_THAT(warnings_, StartsWith("'block' creeps between left_finger, right_finger of 'hand': 2."))
      << warnings_;
  EXPECT_THAT(warnings_, HasSubstr("slower than 1 cm/s"));
  EXPECT_EQ(std::ranges::count(warnings_, '\n'), 1) << warnings_;
}

// -- attached on request

TEST_F(GraspTest, ServicesAttachAndDetach) {
  bring_up_hand(0.8);
  listen("/doppel/grasps");
  const std::string request = "{model1_name: hand, link1_name: palm, model2_name: cube, link2_name: body}";
  EXPECT_THAT(call("/ATTACHLINK", "linkattacher_msgs/srv/AttachLink", request), HasSubstr("success: true"));
  EXPECT_THAT(call("/ATTACHLINK", "linkattacher_msgs/srv/AttachLink", request),
              HasSubstr("are attached already"));
  EXPECT_THAT(call("/gazebo/set_entity_state", "gazebo_msgs/srv/SetEntityState",
                   "{state: {name: cube, pose: {position: {x: 1}}}}"),
              HasSubstr("success: false"));
  move_hand(0.15, 0, 2.0);
  EXPECT_NEAR(height(), 0.165, 1e-3) << "expected the open hand to carry it";
  const std::vector<DiagnosticStatus> statuses = grasps();
  ASSERT_THAT(statuses, SizeIs(1));
  EXPECT_EQ(statuses[0].name, "attachment: hand::palm and cube::body");
  EXPECT_THAT(call("/DETACHLINK", "linkattacher_msgs/srv/DetachLink", request), HasSubstr("success: true"));
  run(1.0);
  EXPECT_NEAR(height(), 0.015, 1e-3);
  EXPECT_THAT(call("/detach", "gazebo_ros_link_attacher/srv/Attach",
                   "{model_name_1: hand, link_name_1: palm, model_name_2: cube, link_name_2: body}"),
              HasSubstr("ok: false"));
  EXPECT_THAT(call("/ATTACHLINK", "linkattacher_msgs/srv/AttachLink",
                   "{model1_name: hand, link1_name: pal, model2_name: cube}"),
              HasSubstr("did you mean 'palm'"));
}

TEST_F(GraspTest, ResetEndsAttachmentOfService) {
  bring_up_hand(0.8);
  EXPECT_THAT(call("/attach", "gazebo_ros_link_attacher/srv/Attach",
                   "{model_name_1: hand, link_name_1: palm, model_name_2: cube, link_name_2: body}"),
              HasSubstr("ok: true"));
  move_hand(0.15, 0, 2.0);
  twin_->reset();
  run(0.5);
  EXPECT_THAT(twin_->engine().attachments(), IsEmpty());
  EXPECT_NEAR(height(), 0.015, 1e-3);
}

TEST_F(GraspTest, DetachableJointHoldsUntilItsTopicDetaches) {
  bring_up_hand(
      0.8,
      R"(<gazebo><plugin filename='gz-sim-detachable-joint-system' name='gz::sim::systems::DetachableJoint'>
<parent_link>palm</parent_link><child_model>cube</child_model><child_link>body</child_link>
<detach_topic>/let_go</detach_topic><attach_topic>/take</attach_topic></plugin></gazebo>)");
  listen("/model/hand/detachable_joint/state");
  move_hand(0.15, 0, 2.0);
  EXPECT_NEAR(height(), 0.165, 1e-3);
  publish("/let_go", "std_msgs/msg/Empty", "{}");
  run(1.0);
  EXPECT_NEAR(height(), 0.015, 1e-3);
  const auto states = received<std_msgs::msg::String>("/model/hand/detachable_joint/state");
  ASSERT_THAT(states, Not(IsEmpty()));
  EXPECT_EQ(states.back().data, "detached");
  publish("/take", "std_msgs/msg/Empty", "{}");
  move_hand(0.2, 0, 1.0);
  EXPECT_NEAR(height(), 0.065, 1e-3);
}

constexpr const char* kJointToCube =
    R"(<gazebo><plugin filename='gz-sim-detachable-joint-system' name='gz::sim::systems::DetachableJoint'>
<parent_link>palm</parent_link><child_model>cube</child_model><child_link>body</child_link>
<detach_topic>/let_go</detach_topic><attach_topic>/take</attach_topic></plugin></gazebo>)";

TEST_F(GraspTest, JointDetachedOnRequestStaysDetachedAfterReload) {
  bring_up_hand(0.8, kJointToCube);
  const auto reload_heavier = [this](const char* mass) {
    std::ifstream file(folder_ / "hand.urdf");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    file.close();
    std::ofstream(folder_ / "hand.urdf")
        << replaced(text, "<mass value='0.", std::string("<mass value='") + mass);
    Diagnostics said;
    twin_->replace(Twin::prepare(twin_->running(), said));
    run(0.2);
  };
  reload_heavier("1.");
  EXPECT_THAT(twin_->engine().attachments(), SizeIs(1)) << "expected the joint to be made again";
  publish("/let_go", "std_msgs/msg/Empty", "{}");
  run(0.1);
  EXPECT_THAT(twin_->engine().attachments(), IsEmpty());
  reload_heavier("2.");
  EXPECT_THAT(twin_->engine().attachments(), IsEmpty());
  publish("/take", "std_msgs/msg/Empty", "{}");
  run(0.1);
  EXPECT_THAT(twin_->engine().attachments(), SizeIs(1));
  EXPECT_THAT(call("/DETACHLINK", "linkattacher_msgs/srv/DetachLink",
                   "{model1_name: hand, link1_name: palm, model2_name: cube, link2_name: body}"),
              HasSubstr("success: true"));
  reload_heavier("3.");
  EXPECT_THAT(twin_->engine().attachments(), IsEmpty()) << "expected the service's request to last";
}

TEST_F(GraspTest, JointIsMadeAgainWithChildThatIsSpawnedAgain) {
  bring_up_hand(0.8, kJointToCube);
  const auto spawn_again = [this] {
    call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: cube}");
    run(0.1);
    call("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
         "{name: cube, initial_pose: {position: {z: 0.015}}, xml: \"" + cube(0.8) + "\"}");
    run(0.1);
  };
  ASSERT_THAT(twin_->engine().attachments(), SizeIs(1));
  spawn_again();
  EXPECT_THAT(twin_->engine().attachments(), SizeIs(1));
  publish("/let_go", "std_msgs/msg/Empty", "{}");
  spawn_again();
  EXPECT_THAT(twin_->engine().attachments(), IsEmpty());
}

// A cube that carries the plugin itself, spawned beside the hand.
TEST_F(GraspTest, SpawnedModelWithDetachableJointIsAttached) {
  bring_up_hand(0.8);
  EXPECT_THAT(
      call(
          "/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
          "{name: second, initial_pose: {position: {x: 0.2, z: 0.015}}, xml: \"" +
              replaced(
                  cube(0.8), "</model>",
                  "<plugin filename='gz-sim-detachable-joint-system' name='d'><parent_link>body</parent_link>"
                  "<child_model>hand</child_model><child_link>palm</child_link></plugin></model>") +
              "\"}"),
      HasSubstr("success: true"));
  move_hand(0.15, 0, 2.0);
  EXPECT_NEAR(pose("second").translation().z(), 0.165, 1e-3);
  publish("/model/second/detachable_joint/detach", "std_msgs/msg/Empty", "{}");
  run(1.0);
  EXPECT_NEAR(pose("second").translation().z(), 0.015, 1e-3);
}

TEST_F(GraspTest, VacuumHoldsWhileItIsOn) {
  bring_up_hand(0.8, R"(<gazebo><plugin name='suction' filename='libgazebo_ros_vacuum_gripper.so'>
<ros><namespace>/cell</namespace><remapping>switch:=suck</remapping></ros>
<link_name>palm</link_name><max_distance>0.1</max_distance></plugin></gazebo>)");
  listen("/cell/grasping");
  move_hand(0.15, 0, 2.0);
  EXPECT_NEAR(height(), 0.015, 1e-3) << "expected nothing to be attached by itself";
  move_hand(0.0, 0, 2.0);
  EXPECT_THAT(call("/cell/suck", "std_srvs/srv/SetBool", "{data: true}"), HasSubstr("success: true"));
  move_hand(0.15, 0, 2.0);
  EXPECT_NEAR(height(), 0.165, 1e-3);
  const auto grasping = received<std_msgs::msg::Bool>("/cell/grasping");
  ASSERT_THAT(grasping, Not(IsEmpty()));
  EXPECT_TRUE(grasping.back().data);
  call("/cell/suck", "std_srvs/srv/SetBool", "{data: false}");
  run(1.0);
  EXPECT_NEAR(height(), 0.015, 1e-3);
}

TEST_F(GraspTest, ReloadKeepsWhatVacuumHolds) {
  bring_up_hand(0.8, R"(<gazebo><plugin name='suction' filename='libgazebo_ros_vacuum_gripper.so'>
<ros><namespace>/cell</namespace><remapping>switch:=suck</remapping></ros>
<link_name>palm</link_name><max_distance>0.1</max_distance></plugin></gazebo>)");
  move_hand(0.0, 0, 2.0);
  call("/cell/suck", "std_srvs/srv/SetBool", "{data: true}");
  move_hand(0.15, 0, 2.0);
  ASSERT_NEAR(height(), 0.165, 1e-3);
  Diagnostics notes;
  twin_->replace(Twin::prepare(twin_->running(), notes));
  run(1.0);
  EXPECT_NEAR(height(), 0.165, 2e-3);
  call("/cell/suck", "std_srvs/srv/SetBool", "{data: false}");
  run(1.0);
  EXPECT_NEAR(height(), 0.015, 1e-3) << "the vacuum that is switched off still holds";
}

TEST_F(GraspTest, ReloadKeepsWhatClassicGripperHolds) {
  bring_up_hand(0.15, R"(<gazebo><gripper name='grip'><grasp_check><attach_steps>100</attach_steps>
<detach_steps>100</detach_steps><min_contact_count>2</min_contact_count></grasp_check>
<gripper_link>left_finger</gripper_link><gripper_link>right_finger</gripper_link>
<palm_link>palm</palm_link></gripper></gazebo>)");
  move_hand(0, 0.03, 1.0);
  move_hand(0.15, 0.03, 2.0);
  ASSERT_NEAR(height(), 0.165, 2e-3);
  Diagnostics notes;
  twin_->replace(Twin::prepare(twin_->running(), notes));
  EXPECT_THAT(twin_->engine().attachments(), SizeIs(1));
  run(1.0);
  EXPECT_NEAR(height(), 0.165, 2e-3);
}

TEST_F(GraspTest, ClassicGripperAttachesWhatItsLinksHold) {
  // Friction alone would not hold it.
  bring_up_hand(0.15, R"(<gazebo><gripper name='grip'><grasp_check><attach_steps>100</attach_steps>
<detach_steps>100</detach_steps><min_contact_count>2</min_contact_count></grasp_check>
<gripper_link>left_finger</gripper_link><gripper_link>right_finger</gripper_link>
<palm_link>palm</palm_link></gripper></gazebo>)");
  EXPECT_THAT(twin_->engine().attachments(), IsEmpty());
  move_hand(0, 0.03, 1.0);
  move_hand(0.15, 0.03, 2.0);
  EXPECT_NEAR(height(), 0.165, 2e-3);
  move_hand(0.15, 0.0, 1.0);
  EXPECT_NEAR(height(), 0.015, 1e-3);
}

TEST_F(GraspTest, MisspeltLinkOfPluginIsReported) {
  std::string warnings;
  log_.add_sink([&](const LogLine& line) {
    if (line.origin == "attach") warnings += line.text;
  });
  bring_up_hand(0.8, R"(<gazebo><plugin filename='ignition-gazebo-detachable-joint-system' name='x'>
<parent_link>pal</parent_link><child_model>cube</child_model><child_link>body</child_link>
</plugin></gazebo>)");
  EXPECT_THAT(warnings, HasSubstr("hand.urdf:"));
  EXPECT_THAT(warnings, HasSubstr("<parent_link> is 'pal', which is no link of 'hand'"));
  EXPECT_THAT(warnings, HasSubstr("did you mean 'palm'"));
}

TEST_F(GraspTest, ValueOfPluginThatIsNoNumberIsReported) {
  std::string warnings;
  log_.add_sink([&](const LogLine& line) {
    if (line.origin == "attach") warnings += line.text;
  });
  bring_up_hand(0.8, R"(<gazebo><plugin name='suction' filename='libgazebo_ros_vacuum_gripper.so'>
<link_name>palm</link_name><max_distance>5 cm</max_distance></plugin>
<gripper name='grip'><grasp_check><attach_steps>2.5</attach_steps></grasp_check>
<gripper_link>left_finger</gripper_link><palm_link>palm</palm_link></gripper></gazebo>)");
  EXPECT_THAT(warnings, HasSubstr("hand.urdf:"));
  EXPECT_THAT(warnings,
              HasSubstr("the plugin 'libgazebo_ros_vacuum_gripper.so' has values that cannot be "
                        "read, and its default is used instead: <max_distance>5 cm (not a number)"));
  EXPECT_THAT(warnings, HasSubstr("<attach_steps>2.5 (not a whole number above 0)"));
}

TEST_F(GraspTest, EngineWithoutAttachmentsRefuses) {
  bring_up_hand(0.8, "", "bullet");
  EXPECT_THAT(call("/ATTACHLINK", "linkattacher_msgs/srv/AttachLink",
                   "{model1_name: hand, link1_name: palm, model2_name: cube}"),
              HasSubstr("the engine bullet cannot attach bodies to each other; start with --engine mujoco"));
}

// -- Kate picks, carries and places (G2 of the specification)

class KateGrasps : public TwinFixture {
 protected:
  void bring_up_kate() {
    Scenario scenario;
    scenario.robots = {{.target = "kate"}};
    scenario.world = DOPPEL_SOURCE_DIR "/worlds/kate_lab.sdf";
    bring_up(scenario);
    run(1.0);
  }
  [[nodiscard]] Instance kate() const { return twin_->robot().instance(); }
  [[nodiscard]] Pose link(const std::string& name) const {
    return kate().link_pose(kate().model().find_link(name));
  }
  [[nodiscard]] Eigen::Vector3d tool() const { return link("katana_gripper_tool_frame").translation(); }
  [[nodiscard]] Pose carton() const { return twin_->engine().find("carton")->base_pose(); }

  // The joints that bring the tool, horizontal, to a point of the world, where nothing yields: the plane of the three
  // lifts is turned by the pan joint, and the wrist is where the hand of 0.4078 m begins.
  [[nodiscard]] std::array<double, 4> reach(const Eigen::Vector3d& p_W) const {
    constexpr double kUpper = 0.19, kFore = 0.139, kToTool = 0.4078;
    const Pose X_WS = link("katana_base_link") * make_pose({0, 0, 0.2015}, {0, 0, 0});
    const Eigen::Vector3d p = X_WS.inverse() * p_W;
    const double r = std::hypot(p.x(), p.y()) - kToTool, far = std::hypot(r, p.z());
    const double at_shoulder = std::acos((kUpper * kUpper + far * far - kFore * kFore) / (2 * kUpper * far));
    const double upper = std::atan2(p.z(), r) + at_shoulder;
    const double fore = std::atan2(p.z() - kUpper * std::sin(upper), r - kUpper * std::cos(upper));
    return {std::atan2(p.y(), p.x()), upper, fore - upper, fore};
  }
  void move_arm(const std::array<double, 4>& q, double seconds) {
    std::string positions;
    for (const double angle : q) positions += std::to_string(angle) + ", ";
    publish("/arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
            "{joint_names: [katana_motor1_pan_joint, katana_motor2_lift_joint, katana_motor3_lift_joint, "
            "katana_motor4_lift_joint, katana_motor5_wrist_roll_joint], points: [{positions: [" +
                positions + "0.0], time_from_start: {sec: " + std::to_string(static_cast<int>(seconds)) +
                "}}]}");
    run(seconds + 0.5);
  }
  // Brings what `where` measures to a point, and corrects what the drives yield by the weight.
  template <typename Where>
  void bring(const Where& where, const Eigen::Vector3d& to, double seconds, double within = 3e-4) {
    Eigen::Vector3d aim = tool() + to - where();
    for (int i = 0; i < 8; ++i) {
      move_arm(reach(aim), i == 0 ? seconds : 1.0);
      const Eigen::Vector3d error = to - where();
      if (error.norm() < within) return;
      aim += error;
    }
  }
  void grip(double position) {
    publish("/gripper_controller/command", "control_msgs/msg/GripperCommand",
            "{position: " + std::to_string(position) + ", max_effort: 1.0}");
    run(1.5);
  }
  // Along x, slowing down over the last decimetres.
  void drive_to(double x) {
    for (int stopped = 0; stopped < 20;) {
      const double left = x - kate().base_pose().translation().x();
      const double speed = std::abs(left) < 2e-3 ? 0.0 : std::clamp(1.5 * left, -0.2, 0.2);
      stopped = speed == 0 ? stopped + 1 : 0;
      ASSERT_LT(to_seconds(twin_->now()), 200.0);
      publish("/base_controller/cmd_vel", "geometry_msgs/msg/TwistStamped",
              "{twist: {linear: {x: " + std::to_string(speed) + "}}}");
      run(0.05);
    }
  }
};

TEST_F(KateGrasps, RobotWithoutLinkIsAttachedByItsBase) {
  bring_up_kate();
  EXPECT_THAT(
      call("/ATTACHLINK", "linkattacher_msgs/srv/AttachLink", "{model1_name: kate, model2_name: can}"),
      HasSubstr("success: true"));
  ASSERT_THAT(twin_->engine().attachments(), SizeIs(1));
  EXPECT_EQ(twin_->engine().attachments()[0].a.link, kate().made_of().base_link());
}

// A carton instead of the can: MuJoCo finds one point of contact between a cylinder and a box, on which a can does not
// stand still to 2 mm.
TEST_F(KateGrasps, CartonIsPickedCarriedAndPlacedWithinTwoMillimetres) {
  constexpr double kInFront = 0.035;  // m, of the tool frame before the middle of the pads
  bring_up_kate();
  call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: can}");
  EXPECT_THAT(
      call("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
           "{name: carton, initial_pose: {position: {x: 1.05, z: 0.7901}}, xml: \"<sdf version='1.9'><model "
           "name='carton'><link "
           "name='body'><inertial><mass>0.2</mass><inertia><ixx>1.9e-4</ixx><iyy>1.9e-4</iyy>"
           "<izz>1.6e-4</izz></inertia></inertial><collision name='c'><geometry><box><size>0.07 0.07 0.08"
           "</size></box></geometry></collision></link></model></sdf>\"}"),
      HasSubstr("success: true"));
  run(1.0);
  const Eigen::Vector3d at = carton().translation();
  grip(0.30);
  move_arm(reach({0.3, 0, 0.82}), 4);
  drive_to(0.74);
  bring([&] { return tool(); }, at + Eigen::Vector3d(kInFront - 0.10, 0, 0), 3, 2e-3);
  bring([&] { return tool(); }, at + Eigen::Vector3d(kInFront, 0, 0), 2);
  grip(-0.44);
  const auto held = [&] { return carton().translation(); };
  bring(held, at + Eigen::Vector3d(0, 0, 0.03), 2, 2e-3);
  drive_to(0.2);
  EXPECT_NEAR(carton().translation().x(), at.x() - 0.54, 5e-3)
      << "expected it to be carried by the driving base";
  EXPECT_THAT(twin_->engine().attachments(), IsEmpty());
  drive_to(0.74);
  const Eigen::Vector3d target = at + Eigen::Vector3d(0, 0.1, 0);
  bring(held, target + Eigen::Vector3d(0, 0, 0.03), 3);
  bring(held, target + Eigen::Vector3d(0, 0, 0.001), 2);
  grip(0.30);
  bring([&] { return tool(); }, tool() - Eigen::Vector3d(0.06, 0, 0), 2, 5e-3);
  drive_to(0.2);
  run(1.0);
  const Eigen::Vector3d error = carton().translation() - target;
  std::cout << "placed within " << 1e3 * error.norm() << " mm\n";
  EXPECT_LT(error.norm(), 2e-3);
  EXPECT_GT(carton().linear()(2, 2), 0.9999) << "expected it upright";
}

}  // namespace
}  // namespace doppel::test
