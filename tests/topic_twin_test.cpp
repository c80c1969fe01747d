// Arms behind topics, in wall-clock time: the driver of a twin, and a node that moves the arm by what the
// driver publishes. Trajectories that are rehearsed before anything is sent.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <map>
#include <thread>

#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "twin_fixture.h"

namespace doppel {
namespace {

using doppel_msgs::msg::Mirror;
using sensor_msgs::msg::JointState;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kArm = R"(<robot name="topic_arm"><link name="world"/>
<link name="base"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0"
 iyz="0"/></inertial><collision><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.1 0.2"/></geometry>
</collision></link>
<link name="upper"><inertial><origin xyz="0 0 0.1"/><mass value="0.05"/><inertia ixx="1e-4" iyy="1e-4"
 izz="5e-5" ixy="0" ixz="0" iyz="0"/></inertial><collision><origin xyz="0 0 0.1"/><geometry>
<box size="0.03 0.03 0.14"/></geometry></collision></link>
<link name="forearm"><inertial><origin xyz="0 0 0.1"/><mass value="MASS"/><inertia ixx="1e-4" iyy="1e-4"
 izz="5e-5" ixy="0" ixz="0" iyz="0"/></inertial><collision><origin xyz="0 0 0.17"/><geometry>
<box size="0.03 0.03 0.3"/></geometry></collision></link>
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/></joint>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.2"/>
<axis xyz="0 1 0"/><limit lower="-1.9" upper="1.9" effort="1.9" velocity="4"/><dynamics damping="0.05"
 friction="0.02"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="forearm"/><origin xyz="0 0 0.2"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1.9" velocity="4"/><dynamics damping="0.05"
 friction="0.02"/></joint>
<ros2_control name="Arm" type="system"><hardware><plugin>doppel/Topic</plugin></hardware>
<joint name="shoulder"><command_interface name="position"/><state_interface name="position"/>
<state_interface name="velocity"/></joint>
<joint name="elbow"><command_interface name="position"/><state_interface name="position"/>
<state_interface name="velocity"/></joint>
</ros2_control></robot>)";

class TopicTwin : public test::TwinFixture {
 protected:
  TopicTwin() {
    log_.add_sink([this](const LogLine& line) { logged_ += line.text + "\n"; });
  }
  ~TopicTwin() override {
    arm_.reset();
    edge_.reset();
    twin_.reset();
  }
  void bring_up_arm(MirrorMode mirror = MirrorMode::shadow, const std::string& world = "",
                    const std::string& mass = "0.03") {
    const std::filesystem::path folder = make_folder("topic_twin");
    std::string text = kArm;
    text.replace(text.find("MASS"), 4, mass);
    std::ofstream(folder / "arm.urdf") << text;
    Scenario scenario;
    scenario.robots = {{.target = (folder / "arm.urdf").string(), .name_space = name_space_}};
    if (!name_space_.empty()) scenario.robots.push_back({.target = "desk_arm", .name_space = "other"});
    scenario.hardware = HardwareUse::real;
    scenario.mirror = mirror;
    if (!world.empty()) {
      std::ofstream(folder / "desk.yaml") << world;
      scenario.world = folder / "desk.yaml";
    }
    bring_up(scenario);
    arm_ = twin_->bus().attach("arm", {.receives_own = false});
    for (const TopicInfo& topic : twin_->bus().topics()) {
      if (topic.name == "/robot_joint_commands") arm_->subscribe(topic.id);
    }
    begin_ = Clock::now();
  }

  // The arm publishes at 100 Hz, and is where it was commanded to be.
  void live(double seconds) {
    const auto end = Clock::now() + std::chrono::duration<double>(seconds);
    while (Clock::now() < end) {
      const Time now{std::chrono::duration_cast<Duration>(Clock::now() - begin_)};
      if (now >= next_state_) {
        next_state_ = now + std::chrono::milliseconds(10);
        move_arm(now);
      }
      while (twin_->now() < now) {
        twin_->between_steps();
        twin_->step();
      }
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
  }
  void move_arm(Time now) {
    for (Edge::Incoming incoming; arm_->next(incoming);) {
      JointState message;
      ASSERT_TRUE(from_cdr(incoming.cdr, message));
      for (std::size_t i = 0; i < message.name.size(); ++i) q_[message.name[i]] = message.position[i];
      ++commands_;
    }
    if (!speaks_) return;
    JointState state;
    state.header.stamp = to_time_msg(now + std::chrono::hours(1));
    for (const auto& [name, q] : q_) {
      state.name.push_back(name);
      state.position.push_back(q);
    }
    ASSERT_TRUE(
        arm_->publish("/arm_driver", "/robot_joint_states", "sensor_msgs/msg/JointState", to_cdr(state)));
  }
  void send(double shoulder, double elbow, double seconds = 1) {
    publish(absolute("joint_trajectory_controller/joint_trajectory"), "trajectory_msgs/msg/JointTrajectory",
            fmt::format("{{joint_names: [shoulder, elbow], points: [{{positions: [{}, {}], time_from_start: "
                        "{{sec: {}, nanosec: {}}}}}]}}",
                        shoulder, elbow, static_cast<int>(seconds),
                        static_cast<int>(1e9 * (seconds - std::floor(seconds)))));
  }
  [[nodiscard]] std::string absolute(const std::string& name) const {
    return (name_space_.empty() ? "/" : "/" + name_space_ + "/") + name;
  }
  [[nodiscard]] HardwareView hardware() const {
    return twin_->robot().controller_manager().hardware().front();
  }
  [[nodiscard]] std::size_t active_controllers() const {
    const auto all = twin_->robot().controller_manager().controllers();
    return static_cast<std::size_t>(std::ranges::count(all, ControllerState::active, &ControllerView::state));
  }

  std::string logged_;
  std::map<std::string, double> q_{{"shoulder", 0.2}, {"elbow", 0.3}};
  int commands_ = 0;
  bool speaks_ = true;
  std::string name_space_;  // of the arm, beside which there is another robot then
  std::unique_ptr<Edge> arm_;

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_;
  Time next_state_{};
};

TEST_F(TopicTwin, ControllersStartWithFirstStatesAndMoveArm) {
  speaks_ = false;
  bring_up_arm();
  live(0.5);
  EXPECT_EQ(hardware().state, HardwareState::inactive);
  EXPECT_EQ(active_controllers(), 0u);
  EXPECT_THAT(logged_, HasSubstr("start with the first states on '/robot_joint_states'"));
  EXPECT_EQ(commands_, 0) << "nothing is published without states";
  speaks_ = true;
  live(0.5);
  EXPECT_EQ(hardware().state, HardwareState::active);
  EXPECT_EQ(active_controllers(), 2u) << logged_;
  EXPECT_NEAR(q_["shoulder"], 0.2, 1e-6) << "activation moves nothing";
  send(0.6, -0.2);
  live(1.5);
  EXPECT_NEAR(q_["shoulder"], 0.6, 1e-3);
  EXPECT_NEAR(q_["elbow"], -0.2, 1e-3);
  EXPECT_NEAR(twin_->robot().instance().q()[0], 0.6, 0.02) << "the twin stands beside the arm";
}

TEST_F(TopicTwin, SilentArmIsFaultAndNotActivatedAgainByItself) {
  bring_up_arm();
  live(0.5);
  send(1.0, 1.0, 2);
  live(0.5);
  speaks_ = false;
  live(1.0);
  EXPECT_EQ(hardware().state, HardwareState::unconfigured);
  EXPECT_THAT(hardware().fault, HasSubstr("no state of all joints has arrived"));
  const int before = commands_;
  speaks_ = true;
  live(0.7);
  EXPECT_EQ(commands_, before);
  EXPECT_EQ(hardware().state, HardwareState::unconfigured);
  ASSERT_TRUE(twin_->robot().controller_manager().set_hardware_state("Arm", HardwareState::inactive));
  live(0.3);
  ASSERT_TRUE(twin_->robot().controller_manager().set_hardware_state("Arm", HardwareState::active));
}

TEST_F(TopicTwin, EmergencyStopHoldsArmWhereItIs) {
  bring_up_arm();
  live(0.5);
  send(1.5, 0, 1);
  live(0.5);
  twin_->robot().controller_manager().stop("the test");
  live(0.05);
  const double stopped_at = q_["shoulder"];
  const int before = commands_;
  live(0.7);
  EXPECT_EQ(q_["shoulder"], stopped_at);
  EXPECT_EQ(commands_, before);
  EXPECT_GT(stopped_at, 0.3);
  EXPECT_LT(stopped_at, 1.4);
}

// -- the loop's threads when their twin ends or changes in motion

class TopicTwinInMotion : public TopicTwin {
 protected:
  ~TopicTwinInMotion() override {
    EXPECT_THAT(logged_, Not(HasSubstr("the control loop was blocked"))) << "the end was taken for a stall";
  }
  // The arm moves for another second, and a map of its reach is computed.
  void begin_motion() {
    bring_up_arm();
    live(0.5);
    ASSERT_EQ(active_controllers(), 2u) << logged_;
    send(1.5, 0, 1.5);
    live(0.5);
    doppel_msgs::srv::GetReach::Request request;
    request.directions = 6;
    edge_->call(absolute("doppel/reach"), to_cdr(request),
                [this](const Status&, const Bytes&) { ++answers_; });
    live(0.05);
    ASSERT_GT(commands_, 10);
  }

  int answers_ = 0;
};

TEST_F(TopicTwinInMotion, EndJoinsLoopAndWatchdogWithWorkUnderWay) {
  begin_motion();
  edge_.reset();
  arm_.reset();
  twin_.reset();
  const std::string logged = logged_;
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(logged_, logged) << "a thread of the twin logs after its end";
}

TEST_F(TopicTwinInMotion, DeletedRobotCommandsItsArmNoLonger) {
  name_space_ = "arm";
  begin_motion();
  EXPECT_THAT(call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: arm}"),
              HasSubstr("success: true"));
  live(0.1);
  const int before = commands_;
  live(0.5);
  EXPECT_EQ(commands_, before);
  EXPECT_EQ(answers_, 1) << "the map of the robot's reach has no other answer";
}

TEST_F(TopicTwinInMotion, ReloadOfSameFilesLeavesMotionToItsEnd) {
  begin_motion();
  Diagnostics found;
  const Twin::Reload reload = twin_->replace(Twin::prepare(twin_->running(), found));
  EXPECT_EQ(reload, Twin::Reload::controllers_kept);
  live(1.5);
  EXPECT_EQ(hardware().state, HardwareState::active) << logged_;
  EXPECT_NEAR(q_["shoulder"], 1.5, 1e-3) << logged_;
}

// -- rehearsals

constexpr const char* kShelf = "objects:\n  - {name: shelf, box: [0.1, 1, 1], xyz: [0.3, 0, 0.5]}\n";

TEST_F(TopicTwin, RehearsalIntoShelfIsRefusedAndNothingIsSent) {
  bring_up_arm(MirrorMode::rehearse, kShelf);
  live(0.5);
  listen("/doppel/mirror");
  ASSERT_EQ(active_controllers(), 2u) << logged_;
  const int before = commands_;
  send(0.2, 1.6);
  live(2);
  EXPECT_THAT(logged_, HasSubstr("in the rehearsal 'forearm' would touch 'shelf' at 0."));
  EXPECT_EQ(commands_, before);
  EXPECT_EQ(q_["elbow"], 0.3);
  const auto mirror = received<Mirror>("/doppel/mirror");
  ASSERT_FALSE(mirror.empty());
  EXPECT_EQ(mirror.back().mode, "rehearse");
}

TEST_F(TopicTwin, RehearsalBeyondEffortOfDriveNamesJointAndTime) {
  bring_up_arm(MirrorMode::rehearse, "", "3");
  live(0.5);
  const int before = commands_;
  send(1.5, 0.3);
  live(2);
  EXPECT_THAT(logged_, HasSubstr("'shoulder' would need more than its effort limit of 1.9 N m"));
  EXPECT_EQ(commands_, before);
}

TEST_F(TopicTwin, RehearsalFasterThanSpeedLimitNamesJointAndTime) {
  bring_up_arm(MirrorMode::rehearse);
  live(0.5);
  const int before = commands_;
  send(0.2, 2.3, 0.2);
  live(1);
  EXPECT_THAT(logged_, HasSubstr("'elbow' would be commanded at "));
  EXPECT_THAT(logged_, HasSubstr("faster than its limit of 4.000 rad/s"));
  EXPECT_EQ(commands_, before);
}

TEST_F(TopicTwin, RehearsalBeyondLimitOfPositionNamesJoint) {
  bring_up_arm(MirrorMode::rehearse);
  live(0.5);
  const int before = commands_;
  send(2.1, -1.5, 2);
  live(1);
  EXPECT_THAT(logged_, HasSubstr("'shoulder' would be commanded to 1.9"));
  EXPECT_THAT(logged_, HasSubstr("rad, beyond its limit of 1.900"));
  EXPECT_EQ(commands_, before);
}

TEST_F(TopicTwin, RehearsedTrajectoryIsFollowedWithoutStallOfLoop) {
  bring_up_arm(MirrorMode::rehearse, kShelf);
  live(0.5);
  const auto longest = [this] { return twin_->robot().controller_manager().loop_statistics()->longest; };
  const double before = longest();
  send(-0.6, -0.5);
  live(1.7);
  EXPECT_NEAR(q_["shoulder"], -0.6, 1e-3) << logged_;
  EXPECT_NEAR(q_["elbow"], -0.5, 1e-3);
  EXPECT_THAT(logged_, Not(HasSubstr("in the rehearsal")));
  std::cout << "longest cycle: " << 1e6 * before << " us before, " << 1e6 * longest()
            << " us with a rehearsal\n";
}

}  // namespace
}  // namespace doppel
