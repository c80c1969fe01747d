// A twin beside real hardware: the driver of one twin moves the emulated arm of another one through a
// pseudo-terminal, in wall-clock time.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <thread>

#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "twin_fixture.h"

namespace doppel {
namespace {

using doppel_msgs::msg::Devices;
using doppel_msgs::msg::Mirror;
using testing::HasSubstr;
using testing::StartsWith;

// It hangs at first: a joint that falls when nothing holds it is refused.
constexpr const char* kMirroredArm = R"(<robot name="desk_arm"><link name="world"/>
<link name="base"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0"
 iyz="0"/></inertial></link>
<link name="fore"><inertial><origin xyz="0.1 0 0"/><mass value="0.3"/><inertia ixx="5e-5" iyy="1e-3"
 izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 0.5"/></joint>
<joint name="lift" type="revolute"><parent link="base"/><child link="fore"/><axis xyz="0 -1 0"/>
<limit lower="-1.9" upper="1.9" effort="1.9" velocity="5"/><dynamics damping="0.05"
 friction="0.02"/></joint>
<ros2_control name="Arm" type="system"><hardware><plugin>doppel/FeetechSts</plugin><param
 name="gentle">never</param><param name="fault_after">8</param>PORT</hardware>
<joint name="lift"><param name="id">1</param><param name="offset_deg">0</param><command_interface
 name="position"/><state_interface name="position"><param
 name="initial_value">-1.55</param></state_interface><state_interface name="velocity"/></joint>
</ros2_control></robot>)";

class MirrorTest : public test::TwinFixture {
 protected:
  // The arm behind a port, and the twin with its driver.
  void bring_up_both(MirrorMode mode) {
    folder_ = make_folder("mirror");
    arm_log_.add_sink([this](const LogLine& line) {
      const std::size_t begin = line.text.find("/dev/pts/");
      if (begin != std::string::npos) port_ = line.text.substr(begin);
    });
    log_.add_sink([this](const LogLine& line) {
      if (line.text.find("cannot be activated") != std::string::npos) refused_ = true;
      if (line.text.find("emergency stop by watchdog") != std::string::npos) blocked_ = true;
      if (line.origin == "mirror") warnings_.push_back(line.text);
    });
    Scenario emulated;
    emulated.robots = {{.target = describe("arm.urdf", "")}};
    emulated.hardware = HardwareUse::ports;
    emulated.emulation.faults = folder_ / "faults.yaml";
    set_faults("[]");
    arm_ = std::make_unique<Twin>(emulated, arm_log_, diagnostics_);
    begin_ = std::chrono::steady_clock::now();
    keeper_ = std::thread([this] {
      while (!ends_) {
        step_to_now(*arm_, begin_);
        std::this_thread::sleep_for(std::chrono::microseconds(300));
      }
    });
    for (int i = 0; i < 500 && port_.empty(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_FALSE(port_.empty());
    Scenario real;
    real.robots = {{.target = describe("real.urdf", "<param name=\"port\">" + port_ + "</param>")}};
    real.hardware = HardwareUse::real;
    real.mirror = mode;
    // The answers of an arm behind a busy machine can come too late for an activation.
    for (int i = 0; i < 5; ++i) {
      refused_ = false;
      bring_up(real);
      if (!refused_) break;
    }
    ASSERT_FALSE(refused_);
    twin_begin_ = std::chrono::steady_clock::now();
  }
  ~MirrorTest() override {
    edge_.reset();
    twin_.reset();
    ends_ = true;
    if (keeper_.joinable()) keeper_.join();
  }

  void set_faults(const std::string& faults) const {
    std::ofstream(folder_ / "faults.yaml") << "faults: " << faults << "\n";
  }
  void live(double seconds) {
    live_until([] { return false; }, seconds);
  }
  // A busy machine takes the time of both twins, so a state is awaited where it can be.
  template <typename Condition>
  bool live_until(Condition condition, double seconds = 20) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (std::chrono::steady_clock::now() < end) {
      step_to_now(*twin_, twin_begin_);
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
    return false;
  }
  // The watchdog of the control loop stops everything where a busy machine has blocked the test for 0.2 s.
  void resume() {
    if (!std::exchange(blocked_, false)) return;
    call("/controller_manager/reset_emergency_stop", "std_srvs/srv/Trigger", "{}");
    call("/controller_manager/switch_controller", "controller_manager_msgs/srv/SwitchController",
         "{activate_controllers: [joint_trajectory_controller], strictness: 2}");
  }
  // Repeats the goal: a stopped controller accepts none.
  template <typename Condition>
  bool go_until(double lift, Condition condition) {
    for (int i = 0; i < 6; ++i) {
      resume();
      go_to(lift);
      if (live_until(condition, 4)) return true;
    }
    return false;
  }
  void go_to(double lift) {
    publish("/joint_trajectory_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
            "{joint_names: [lift], points: [{positions: [" + std::to_string(lift) +
                "], time_from_start: {sec: 1}}]}");
  }
  [[nodiscard]] double measured() const { return twin_->robot().controller_manager().state("lift/position"); }
  [[nodiscard]] double twin() const { return twin_->robot().instance().q()[0]; }
  Mirror mirror() {
    const auto all = received<Mirror>("/doppel/mirror");
    EXPECT_FALSE(all.empty());
    return all.empty() ? Mirror{} : all.back();
  }

  std::filesystem::path folder_;
  std::vector<std::string> warnings_;
  bool refused_ = false;
  bool blocked_ = false;

 private:
  using WallTime = std::chrono::steady_clock::time_point;
  std::string describe(const char* name, const std::string& port) const {
    std::string text = kMirroredArm;
    text.replace(text.find("PORT"), 4, port);
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  static void step_to_now(Twin& twin, WallTime begin) {
    const Time now{std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now() - begin)};
    while (twin.now() < now) {
      twin.between_steps();
      twin.step();
    }
  }

  Log arm_log_;
  std::unique_ptr<Twin> arm_;
  std::string port_;
  WallTime begin_, twin_begin_;
  std::atomic<bool> ends_{false};
  std::thread keeper_;
};

// The angle of a rotation about -y.
double angle_in_tf(const std::vector<tf2_msgs::msg::TFMessage>& messages) {
  double out = std::numeric_limits<double>::quiet_NaN();
  for (const auto& message : messages) {
    for (const auto& one : message.transforms) {
      if (one.child_frame_id == "fore")
        out = -2 * std::atan2(one.transform.rotation.y, one.transform.rotation.w);
    }
  }
  return out;
}

TEST_F(MirrorTest, TransformsShowMeasuredJointsAndTwinMovesWithCommands) {
  bring_up_both(MirrorMode::shadow);
  live(2.5);  // the torque's ramp
  ASSERT_TRUE(
      go_until(-0.7, [&] { return std::abs(measured() + 0.7) < 0.05 && std::abs(twin() + 0.7) < 0.05; }))
      << "measured " << measured() << ", its twin, whose drive gets the command, " << twin();
  listen("/tf");
  set_faults("[{fault: stuck}]");
  live(0.7);
  EXPECT_TRUE(go_until(0.6, [&] { return std::abs(twin() - 0.6) < 0.05; })) << twin();
  EXPECT_LT(measured(), -0.6);
  EXPECT_NEAR(angle_in_tf(received<tf2_msgs::msg::TFMessage>("/tf")), measured(), 0.01);
  EXPECT_NEAR(joint("lift").q, measured(), 1e-9);
}

TEST_F(MirrorTest, BlockedJointIsAlarmAndWarningOnce) {
  bring_up_both(MirrorMode::shadow);
  live(3.0);
  listen("/doppel/mirror");
  listen("/doppel/hardware");
  live(0.2);
  const Mirror quiet = mirror();
  ASSERT_EQ(quiet.joints.size(), 1u);
  EXPECT_EQ(quiet.mode, "shadow");
  EXPECT_EQ(quiet.joints[0].alarm, "") << quiet.joints[0].error;
  EXPECT_LT(std::abs(quiet.joints[0].error), 0.03);
  EXPECT_FALSE(quiet.joints[0].believed);
  set_faults("[{fault: stuck}]");
  live(0.7);
  const auto devices = received<Devices>("/doppel/hardware");
  ASSERT_FALSE(devices.empty());
  ASSERT_EQ(devices.back().devices.size(), 1u);
  EXPECT_EQ(devices.back().devices[0].component_state, "active");
  EXPECT_THAT(devices.back().devices[0].port, StartsWith("/dev/pts/"));
  EXPECT_EQ(devices.back().devices[0].joints[0].id, 1);
  EXPECT_TRUE(go_until(0.8, [&] { return !warnings_.empty(); }));
  live(0.3);
  EXPECT_THAT(mirror().joints[0].alarm, StartsWith("stall"));
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_THAT(warnings_[0], HasSubstr("'lift' is not where its twin is"));
}

TEST_F(MirrorTest, ReleasedJointFallsWithoutAlarm) {
  bring_up_both(MirrorMode::shadow);
  live(2.5);
  ASSERT_TRUE(go_until(-0.7, [&] { return std::abs(measured() + 0.7) < 0.02; })) << measured();
  live(1.5);
  listen("/doppel/mirror");
  call("/doppel/hardware/release_joint", "doppel_msgs/srv/ReleaseJoint",
       "{joint: lift, duration: 0.3, lower: -1.8, upper: 0.5, speed: 4.5}");
  ASSERT_TRUE(live_until([&] { return measured() < -0.8; }, 5)) << measured();
  live(1.5);
  bool noted = false;
  for (const Mirror& one : received<Mirror>("/doppel/mirror")) {
    ASSERT_EQ(one.joints.size(), 1u);
    EXPECT_EQ(one.joints[0].alarm, "");
    noted = noted || one.joints[0].note.find("its torque is off") != std::string::npos;
  }
  EXPECT_TRUE(noted);
  EXPECT_THAT(warnings_, testing::IsEmpty());
}

TEST_F(MirrorTest, FollowPutsTwinWhereArmIsAndChangesNoGoal) {
  bring_up_both(MirrorMode::follow);
  live(3.0);
  listen("/doppel/mirror");
  listen("/doppel/hardware");
  live(0.3);
  const auto before = received<Devices>("/doppel/hardware");
  ASSERT_FALSE(before.empty());
  const double goal = before.back().devices[0].joints[0].goal;
  const double before_slip = measured();
  set_faults("[{fault: slip, amount: 5 deg}]");  // the reading jumps, and the arm moves
  EXPECT_TRUE(live_until([&] { return std::abs(measured() - before_slip) > 0.02; }));
  live(1.0);
  EXPECT_NEAR(twin(), measured(), 0.01);
  for (const Devices& one : received<Devices>("/doppel/hardware"))
    EXPECT_NEAR(one.devices[0].joints[0].goal, goal, 0.002) << "the twin sends nothing";
  live(0.2);
  const Mirror now = mirror();
  EXPECT_EQ(now.mode, "follow");
  EXPECT_TRUE(std::isnan(now.joints[0].error));
  EXPECT_THAT(now.joints[0].note, HasSubstr("follow"));
}

}  // namespace
}  // namespace doppel
