// Gains of arms of our own: they fail T4 as written, pass as tuned, and are written without another change.
#include "doppel/validation/tuning/tune.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "doppel/validation/tuning/detail/joint_plants.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct ArmLink {
  double length, mass, along, motor;  // along: inertia about its length; motor: about the joint, reflected
  double effort;
  const char* axis;
};
const std::vector<ArmLink> kSixJoints = {
    {0.1, 2, 0.15, 0, 40, "0 0 1"},         {0.3, 2, 0.0036, 0.15, 80, "0 1 0"},
    {0.25, 1.5, 0.0027, 0.06, 40, "0 1 0"}, {0.1, 0.6, 0.0011, 0, 12, "1 0 0"},
    {0.08, 0.4, 0.0007, 0, 8, "0 1 0"},     {0.06, 0.2, 0.0004, 0, 5, "1 0 0"}};
const std::vector<ArmLink> kOneJoint = {{0.3, 1, 0.0018, 0, 20, "0 1 0"}};

std::string arm_description(const std::vector<ArmLink>& links, const std::string& interface) {
  std::string out =
      R"(<robot name="tuned_arm"><link name="world"/><link name="base"><inertial><mass value="5"/>
<inertia ixx="0.05" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/></joint>
)";
  std::string hardware, parent = "base";
  for (std::size_t i = 0; i < links.size(); ++i) {
    const ArmLink& link = links[i];
    const bool upright = i == 0 && links.size() > 1;
    const double across = link.mass * link.length * link.length / 12 + 2e-4 + link.motor, along = link.along;
    out += fmt::format(
        "<link name=\"l{}\"><inertial><origin xyz=\"{} 0 {}\"/><mass value=\"{}\"/><inertia ixx=\"{}\" "
        "iyy=\"{}\" "
        "izz=\"{}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n",
        i + 1, upright ? 0 : link.length / 2, upright ? link.length / 2 : 0, link.mass, along,
        upright ? along : across, upright ? along : across);
    const std::string origin = i == 0   ? "0 0 0.3"
                               : i == 1 ? "0 0 0.1"
                                        : fmt::format("{} 0 0", links[i - 1].length);
    out += fmt::format(
        "<joint name=\"j{}\" type=\"revolute\"><parent link=\"{}\"/><child link=\"l{}\"/><origin xyz=\"{}\"/>"
        "<axis xyz=\"{}\"/><limit lower=\"-2.5\" upper=\"2.5\" effort=\"{}\" velocity=\"6\"/>"
        "<dynamics damping=\"0.1\" friction=\"0.05\"/></joint>\n",
        i + 1, parent, i + 1, origin, link.axis, link.effort);
    parent = fmt::format("l{}", i + 1);
    hardware += fmt::format(
        "<joint name=\"j{}\"><command_interface name=\"{}\"/><state_interface name=\"position\"/>"
        "<state_interface name=\"velocity\"/></joint>\n",
        i + 1, interface);
  }
  return out +
         "<ros2_control name=\"drives\" "
         "type=\"system\"><hardware><plugin>mock_components/GenericSystem</plugin>"
         "</hardware>\n" +
         hardware + "</ros2_control></robot>\n";
}

std::string arm_controllers(std::size_t joints, const std::string& interface, int rate,
                            const std::string& gains) {
  std::string names, lines;
  for (std::size_t i = 1; i <= joints; ++i) {
    names += fmt::format("{}j{}", i == 1 ? "" : ", ", i);
    lines += fmt::format("      j{}: {}\n", i, gains);
  }
  return fmt::format(R"(# The arm's controllers.
controller_manager:
  ros__parameters:
    update_rate: {}  # Hz
    joint_state_broadcaster: {{type: joint_state_broadcaster/JointStateBroadcaster}}
    arm_controller: {{type: joint_trajectory_controller/JointTrajectoryController}}

arm_controller:
  ros__parameters:
    joints: [{}]
    command_interfaces: [{}]
    state_interfaces: [position, velocity]
    gains:   # guesses
)",
                     rate, names, interface) +
         lines;
}

class Tune : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / "tune" / info->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }

  void make(const std::vector<ArmLink>& links, const std::string& interface, int rate,
            const std::string& gains) {
    write("arm.urdf", arm_description(links, interface));
    text_ = arm_controllers(links.size(), interface, rate, gains);
    write("arm.yaml", text_);
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  [[nodiscard]] Subject subject() const {
    Scenario scenario;
    WorldRobot& robot = scenario.robots.emplace_back();
    robot.target = (folder_ / "arm.urdf").string();
    robot.controllers = {folder_ / "arm.yaml"};
    return read_subject(scenario, {});
  }
  [[nodiscard]] static TuneReport tuned(const Subject& subject, const TuneOptions& options = {}) {
    TuneOptions how = options;
    how.jobs = 2;
    return tune(subject, Suite{}, how);
  }
  [[nodiscard]] std::string written(const std::string& text, const TuneReport& report) const {
    return with_new_gains(text, folder_ / "arm.yaml", report);
  }

  fs::path folder_;
  std::string text_;
};

// The bytes outside of the gains' numbers.
std::string without_gains(const std::string& text) {
  std::string out;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    const std::string line = text.substr(begin, end - begin);
    const std::size_t open = line.find("{p:"), close = line.find('}');
    out += open == std::string::npos ? line : line.substr(0, open) + line.substr(close);
    begin = end;
  }
  return out;
}

TEST_F(Tune, OneJointWithEffortPassesOnceWritten) {
  make(kOneJoint, "effort", 500, "{p: 20, i: 0, d: 0.1}  # a guess");
  const TuneReport report = tuned(subject());
  ASSERT_EQ(report.joints.size(), 1U);
  const TunedJoint& joint = report.joints.front();
  EXPECT_TRUE(joint.gains_act);
  EXPECT_FALSE(joint.before.passed);
  EXPECT_TRUE(joint.passed()) << to_text(report);
  EXPECT_TRUE(joint.perturbed.judged && joint.perturbed.passed);
  EXPECT_EQ(report.runs, 27);
  EXPECT_NEAR(joint.plant.most_inertia, 1 * 0.3 * 0.3 / 3 + 2e-4,
              1e-6);  // of a rod about its end
  EXPECT_NEAR(joint.plant.gravity, 9.81 * 0.15, 0.02);

  const std::string first = written(text_, report);
  EXPECT_EQ(without_gains(first), without_gains(text_));
  EXPECT_THAT(first, HasSubstr("}  # a guess\n"));
  write("arm.yaml", first);
  const TuneReport again = tuned(subject());
  EXPECT_TRUE(again.joints.front().before.passed) << to_text(again);
  EXPECT_EQ(written(first, again), first);
}

TEST_F(Tune, SixJointsWithEffortPassWithMarginAndPerturbed) {
  make(kSixJoints, "effort", 1000, "{p: 30, d: 0.3}");
  const TuneReport report = tuned(subject());
  ASSERT_EQ(report.joints.size(), 6U);
  EXPECT_TRUE(report.passed()) << to_text(report);
  for (const TunedJoint& joint : report.joints) {
    EXPECT_GE(joint.design->phase_margin(), kPhaseMargin - 1e-9) << joint.joint;
    EXPECT_GE(joint.design->gain_margin(), kGainMargin - 1e-9) << joint.joint;
  }
  EXPECT_EQ(without_gains(written(text_, report)), without_gains(text_));
}

TEST_F(Tune, VelocityLoopsPass) {
  make(kSixJoints, "velocity", 500, "{p: 1, i: 0}");
  const TuneReport report = tuned(subject());
  EXPECT_TRUE(report.passed()) << to_text(report);
  EXPECT_FALSE(report.joints.front().before.passed);
}

TEST_F(Tune, PidControllersPassOnceWritten) {
  make(kOneJoint, "effort", 500, "{}");
  text_ = R"(controller_manager:
  ros__parameters:
    update_rate: 500
    pid: {type: pid_controller/PidController}
pid:
  ros__parameters:
    dof_names: [j1]
    command_interface: effort
    reference_and_state_interfaces: [position, velocity]
    gains:
      j1: {p: 20.0, i: 0.0, d: 0.1}
)";
  write("arm.yaml", text_);
  const TuneReport report = tuned(subject());
  EXPECT_TRUE(report.any_gains_act());
  EXPECT_TRUE(report.joints.front().after.judged);
  EXPECT_TRUE(report.passed()) << to_text(report);
  write("arm.yaml", written(text_, report));
  EXPECT_TRUE(tuned(subject()).joints.front().before.passed);
}

TEST_F(Tune, PositionCommandsHaveNoGains) {
  make(kOneJoint, "position", 100, "{p: 200}");
  const TuneReport report = tuned(subject());
  EXPECT_FALSE(report.any_gains_act());
  EXPECT_TRUE(report.passed());
  EXPECT_THAT(to_text(report), HasSubstr("gains of a controller do nothing there"));
  EXPECT_GT(report.joints.front().stiffness, 0);
}

TEST_F(Tune, SlowControllersHaveNoGains) {
  make(kOneJoint, "effort", 20, "{p: 20, i: 0, d: 0.1}");
  const TuneReport report = tuned(subject());
  EXPECT_FALSE(report.passed());
  EXPECT_THAT(to_text(report), HasSubstr("T4 FAILS for 1 of 1 joints"));
}

// A relay that acts through the controller switches at its instants, so that its delay is anything up to a
// period: the ultimate point is between those of the model with these delays.
TEST_F(Tune, RelayIsWithinDelaysOfModel) {
  make(kOneJoint, "effort", 500, "{p: 20, i: 0, d: 0.1}");
  std::string description = arm_description(kOneJoint, "effort");
  const std::string dry = "damping=\"0.1\" friction=\"0.05\"";
  description.replace(description.find(dry), dry.size(), "damping=\"2\" friction=\"0\"");
  write("arm.urdf", description);
  TuneOptions options;
  options.relay = true;
  const TuneReport report = tuned(subject(), options);
  const TunedJoint& joint = report.joints.front();
  ASSERT_TRUE(joint.relay);
  const RelayCheck& relay = *joint.relay;
  ASSERT_EQ(relay.refusal, "");
  JointPlant plant = joint.plant;
  plant.delay = joint.period;
  const auto late = ultimate_point(plant, plant.most_inertia);
  plant.delay = 0.1 * joint.period;
  const auto prompt = ultimate_point(plant, plant.most_inertia);
  ASSERT_TRUE(late && prompt);
  EXPECT_GT(relay.relay.period, prompt->period);
  EXPECT_LT(relay.relay.period, late->period);
  EXPECT_GT(relay.relay.gain, late->gain);
  EXPECT_LT(relay.relay.gain, prompt->gain);
  ASSERT_EQ(relay.rules.size(), 3U);
  EXPECT_GT(relay.rules.front().step.overshoot, joint.after.overshoot);
}

TEST_F(Tune, FileWithoutGainsIsRefusedWithLineToWrite) {
  make(kOneJoint, "effort", 500, "{i: 0}");
  const TuneReport report = tuned(subject());
  try {
    static_cast<void>(written(text_, report));
    FAIL() << "expected an error";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("arm_controller has no gains of j1"));
    EXPECT_THAT(e.what(), HasSubstr("gains: {j1: {p: "));
  }
}

TEST_F(Tune, ProgressEndsWork) {
  make(kOneJoint, "effort", 500, "{p: 20}");
  TuneOptions options;
  int calls = 0;
  options.progress = [&](double, const std::string&) { return ++calls < 3; };
  EXPECT_THROW(static_cast<void>(tuned(subject(), options)), CheckCancelled);
}

TEST_F(Tune, LoadsOfFreeJointsAreSmaller) {
  make(kSixJoints, "effort", 1000, "{p: 30}");
  const Subject machine = subject();
  ToolLoad tool;
  const auto bare = joint_loads(machine, tool, 200);
  tool.link = "l6";
  tool.mass = 1;
  const auto loaded = joint_loads(machine, tool, 200);
  for (std::size_t i = 0; i < bare.size(); ++i) {
    if (!(bare[i].most_inertia > 0)) continue;
    EXPECT_LE(bare[i].least_inertia, bare[i].most_inertia);
    EXPECT_GE(loaded[i].most_inertia, bare[i].most_inertia);
    EXPECT_LE(loaded[i].least_inertia, bare[i].least_inertia + 1e-12);
  }
}

}  // namespace
}  // namespace doppel
