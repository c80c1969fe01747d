// A twin whose physics diverges: nothing that comes from outside ends it.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/twin/assembly/fuzz/extreme_calls.h"
#include "doppel/twin/assembly/runner.h"
#include "doppel/twin/loop/load_range.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class Divergence : public TwinFixture {
 protected:
  Divergence() {
    log_.add_sink([this](const LogLine& line) { logged_ += line.text + '\n'; });
  }
  // An effort that no service accepts.
  void tear(const std::string& name = "j1", double effort = 1e200) {
    Instance robot = twin_->robot().instance();
    robot.apply_joint_effort(robot.model().find_joint(name), effort);
    twin_->step();
    ASSERT_TRUE(twin_->diverged());
  }
  std::string effort(const std::string& joint, const std::string& value) {
    return call("/gazebo/apply_joint_effort", "gazebo_msgs/srv/ApplyJointEffort",
                "{joint_name: '" + joint + "', effort: " + value + ", duration: {sec: 10}}");
  }

  std::string logged_;
};

TEST_F(Divergence, LiveTwinIsPausedWithCauseAndContinuesAfterReset) {
  bring_up("lab_arm");
  twin_->time_control().pauses_at_divergence = true;
  run(0.1);
  const double q = joint("j1").q;
  const std::string step = fmt::format("in step {} (t = 0.100 s)", twin_->steps() + 1);
  tear();
  twin_->between_steps();
  EXPECT_TRUE(twin_->time_control().paused);
  EXPECT_THAT(twin_->time_control().divergence, HasSubstr("the physics diverged " + step));
  EXPECT_THAT(logged_, HasSubstr("/gazebo/reset_simulation continues"));
  EXPECT_EQ(joint("j1").q, q) << "expected the last finite state";
  EXPECT_THAT(call("/gazebo/step", "doppel_msgs/srv/Step", "{steps: 5}"),
              AllOf(HasSubstr("success: false"), HasSubstr("reset_simulation")));
  call("/gazebo/unpause_physics", "std_srvs/srv/Empty", "{}");
  EXPECT_TRUE(twin_->time_control().paused) << "expected that time cannot go on before a reset";
  EXPECT_THAT(logged_, HasSubstr("unpause_physics: the physics has diverged"));
  call("/gazebo/reset_simulation", "std_srvs/srv/Empty", "{}");
  EXPECT_FALSE(twin_->time_control().paused);
  EXPECT_EQ(twin_->time_control().divergence, "");
  EXPECT_FALSE(twin_->diverged());
  run(0.2);
  EXPECT_NEAR(to_seconds(twin_->now()), 0.2, to_seconds(twin_->step_size()));
}

TEST_F(Divergence, PosesOfLastFiniteStateAreComputedAgain) {
  bring_up("lab_arm");
  run(0.1);
  const Instance robot = twin_->robot().instance();
  const int last = static_cast<int>(robot.model().links.size()) - 1;
  const Pose before = robot.link_pose(last);
  tear();
  EXPECT_TRUE(robot.link_pose(last).isApprox(before, 1e-12))
      << robot.link_pose(last).translation().transpose();
}

TEST_F(Divergence, UserPauseOutlastsReset) {
  bring_up("lab_arm");
  twin_->time_control().pauses_at_divergence = true;
  call("/gazebo/pause_physics", "std_srvs/srv/Empty", "{}");
  tear();
  twin_->between_steps();
  call("/gazebo/reset_simulation", "std_srvs/srv/Empty", "{}");
  EXPECT_TRUE(twin_->time_control().paused);
  EXPECT_EQ(twin_->time_control().divergence, "");
}

TEST_F(Divergence, OwedStepsAreRefused) {
  bring_up("lab_arm");
  twin_->time_control().pauses_at_divergence = true;
  call("/gazebo/pause_physics", "std_srvs/srv/Empty", "{}");
  std::string answer;
  edge_->call("/gazebo/step", to_cdr(doppel_msgs::srv::Step::Request{50}),
              [&](const Status&, const Bytes& response) {
                doppel_msgs::srv::Step::Response out;
                if (from_cdr(response, out).ok()) answer = out.message;
              });
  twin_->between_steps();
  tear();
  twin_->between_steps();
  EXPECT_THAT(answer, HasSubstr("diverged"));
  EXPECT_EQ(twin_->time_control().steps_owed, 0u);
}

TEST_F(Divergence, RunWithoutDurationGoesOnAndOthersEnd) {
  bring_up("lab_arm");
  std::atomic<bool> stop{false};
  Runner ending(*twin_, {.speed = 0.0, .duration = from_seconds(5.0), .ends_at_divergence = true});
  tear();
  EXPECT_EQ(ending.run(stop).end, RunEnd::diverged);
  twin_->reset();
  Runner live(*twin_, {.speed = 0.0, .duration = {}});
  tear();
  std::thread client([&] {
    while (!live.view().paused.load()) std::this_thread::yield();
    twin_->bus().post([&] { twin_->reset(); });
    while (live.view().paused.load()) std::this_thread::yield();
    stop = true;
  });
  EXPECT_EQ(live.run(stop).end, RunEnd::stopped);
  client.join();
}

TEST_F(Divergence, ExtremeEffortIsRefusedWithRange) {
  bring_up("lab_arm");  // 1.5 N m
  EXPECT_THAT(effort("j1", "1.0e6"), AllOf(HasSubstr("success: false"), HasSubstr("it can be from -")));
  EXPECT_THAT(effort("j1", ".nan"), HasSubstr("not a finite number"));
  EXPECT_THAT(effort("j1", "10"), HasSubstr("success: true"));
  const double most = 1e4;
  for (int i = 0; i < 200; ++i) effort("j1", std::to_string(most / 100));
  run(0.05);
  EXPECT_FALSE(twin_->diverged()) << "expected the sum of the efforts to be limited, too";
}

TEST_F(Divergence, ExtremeWrenchIsRefusedWithRange) {
  bring_up("lab_arm");
  const auto push = [&](const std::string& wrench) {
    return call("/gazebo/apply_body_wrench", "gazebo_msgs/srv/ApplyBodyWrench",
                "{body_name: '" + twin_->robot().instance().model().links.back().name +
                    "', wrench: " + wrench + ", duration: {sec: 10}}");
  };
  EXPECT_THAT(push("{force: {x: 1.0e6}}"), AllOf(HasSubstr("success: false"), HasSubstr("can be up to")));
  EXPECT_THAT(push("{torque: {x: 1.0e6}}"), AllOf(HasSubstr("success: false"), HasSubstr("can be up to")));
  EXPECT_THAT(push("{force: {x: 5}}"), HasSubstr("success: true"));
}

TEST_F(Divergence, ExtremeStateIsRefusedWithRange) {
  bring_up("lab_arm");
  const auto set = [&](const std::string& q, const std::string& v) {
    return call("/gazebo/set_state", "doppel_msgs/srv/SetState",
                "{names: [j1], positions: [" + q + "], velocities: [" + v + "]}");
  };
  EXPECT_THAT(set("0.1", "-1e300"), AllOf(HasSubstr("success: false"), HasSubstr("it can be set from -")));
  EXPECT_THAT(set("0.1", "2"), HasSubstr("success: true"));
}

// A continuous joint has no limits of its own.
TEST_F(Divergence, WheelHasRangesAndSurvivesTheirEnds) {
  bring_up("kate");
  const Instance robot = twin_->robot().instance();
  const auto wheel = std::ranges::find_if(robot.model().joints, [](const ModelJoint& joint) {
    return joint.type == JointType::continuous && !joint.mimics();
  });
  ASSERT_NE(wheel, robot.model().joints.end());
  const std::string name = wheel->name;
  const int index = static_cast<int>(wheel - robot.model().joints.begin());
  EXPECT_THAT(
      call("/gazebo/set_state", "doppel_msgs/srv/SetState", "{names: ['" + name + "'], positions: [-1e300]}"),
      AllOf(HasSubstr("success: false"), HasSubstr("it can be set from -1e+06 to 1e+06")));
  EXPECT_THAT(call("/gazebo/set_model_configuration", "gazebo_msgs/srv/SetModelConfiguration",
                   "{joint_names: ['" + name + "'], joint_positions: [-1e300]}"),
              HasSubstr("success: false"));
  const double most = max_effort(robot, index);
  EXPECT_THAT(effort(name, std::to_string(0.99 * most)), HasSubstr("success: true"));
  EXPECT_THAT(effort(name, std::to_string(0.99 * most)), HasSubstr("with those that act already"));
  run(1.0);
}

TEST_F(Divergence, SpeedOutsideItsRangeIsRefused) {
  bring_up("lab_arm");
  const auto set = [&](const std::string& factor) {
    return call("/gazebo/set_speed", "doppel_msgs/srv/SetSpeed", "{factor: " + factor + "}");
  };
  for (const char* factor : {"1e6", "1e-300", "-1", ".nan"})
    EXPECT_THAT(set(factor), AllOf(HasSubstr("success: false"), HasSubstr("from 0.001 to 1000"))) << factor;
  for (const char* factor : {"0", "0.001", "1000"})
    EXPECT_THAT(set(factor), HasSubstr("success: true")) << factor;
}

// 1 kg in 1000 m on the robot and on the ground.
TEST_F(Divergence, HugeBoxOnRobotDoesNotEndTwin) {
  bring_up("omarm_one");
  twin_->time_control().pauses_at_divergence = true;
  const std::string said = call("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
                                "{name: x, initial_pose: {orientation: {w: 1.0}}, xml: \"<sdf "
                                "version='1.6'><model name='b'><link name='l'>"
                                "<collision name='c'><geometry><box><size>1000 1000 "
                                "1000</size></box></geometry></collision></link></model></sdf>\"}");
  for (int i = 0; i < 300; ++i) {
    twin_->between_steps();
    twin_->step();
  }
  twin_->between_steps();
  if (said.find("success: false") != std::string::npos) {
    EXPECT_THAT(said, HasSubstr("the physics diverges"));
    EXPECT_FALSE(twin_->diverged());
  } else {
    EXPECT_EQ(twin_->diverged(), twin_->time_control().paused);
  }
}

TEST_F(Divergence, LastRobotInNamespaceCanBeDeleted) {
  Scenario scenario;
  scenario.robots = {{.target = "lab_arm", .name_space = "a"}};
  bring_up(scenario);
  run(0.05);
  EXPECT_THAT(call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: a}"),
              HasSubstr("success: true"));
  run(0.05);
  EXPECT_TRUE(twin_->robots().empty());
  bring_up("lab_arm");
  EXPECT_THAT(
      call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: '" + twin_->robot().name() + "'}"),
      AllOf(HasSubstr("success: false"), HasSubstr("--robot TARGET:NAMESPACE")));
}

// A world in a file that is edited.
class EditedWorld : public Divergence {
 protected:
  void SetUp() override {
    folder_ = make_folder("divergence");
    save("gravity: [0, 0, -9.81]\n");
    scenario_.world = folder_ / "world.yaml";
    scenario_.robots = {{.target = "lab_arm"}};
    bring_up(scenario_);
  }
  void TearDown() override {
    edge_.reset();
    twin_.reset();
    fs::remove_all(folder_);
  }
  void save(const std::string& text) {
    std::ofstream(folder_ / "world.yaml")
        << "objects: [{name: ball, sphere: {radius: 0.05}, mass: 0.1, xyz: [1, 0, 0.5]}]\n"
        << text;
  }
  void reload() {
    Diagnostics said;
    twin_->replace(Twin::prepare(twin_->running(), said));
  }
  [[nodiscard]] double gravity() const { return twin_->engine().world().settings().gravity.z(); }

  fs::path folder_;
  Scenario scenario_;
};

TEST_F(EditedWorld, EditThatDivergesAtOnceIsRefused) {
  run(0.1);
  save("gravity: [0, 0, -1.0e12]\n");
  try {
    reload();
    FAIL() << "expected the edit to be refused";
  } catch (const InputError& refused) {
    EXPECT_THAT(refused.what(), HasSubstr("with this edit the physics diverges"));
  }
  EXPECT_EQ(gravity(), -9.81);
  run(0.2);
}

TEST_F(EditedWorld, EditThatDivergesSoonIsTakenBack) {
  run(0.1);
  save("gravity: [0, 0, -5]\n");
  reload();
  run(0.3);
  EXPECT_EQ(gravity(), -5);
  tear();
  twin_->between_steps();
  EXPECT_EQ(gravity(), -9.81);
  EXPECT_FALSE(twin_->diverged());
  EXPECT_THAT(logged_, HasSubstr("is taken back"));
  run(0.2);
  EXPECT_NEAR(to_seconds(twin_->now()), 0.6, 0.002) << "expected time to go on";
}

TEST_F(EditedWorld, EditThatRanForLongIsNotTakenBack) {
  twin_->time_control().pauses_at_divergence = true;
  save("gravity: [0, 0, -5]\n");
  reload();
  run(1.2);
  tear();
  twin_->between_steps();
  EXPECT_EQ(gravity(), -5);
  EXPECT_TRUE(twin_->time_control().paused);
}

TEST_F(EditedWorld, DivergedTwinContinuesWithCorrectedFile) {
  twin_->time_control().pauses_at_divergence = true;
  run(0.1);
  tear();
  twin_->between_steps();
  ASSERT_TRUE(twin_->time_control().paused);
  save("gravity: [0, 0, -5]\n");
  reload();
  twin_->between_steps();
  EXPECT_FALSE(twin_->time_control().paused);
  run(0.1);
}

// The last finite state moves too fast for any model.
TEST_F(EditedWorld, CorrectedFileStartsAgainWhereStateHadDiverged) {
  save("gravity: [0, 0, -1.0e9]\n");
  bring_up(scenario_);
  twin_->time_control().pauses_at_divergence = true;
  for (int i = 0; i < 300 && !twin_->diverged(); ++i) {
    twin_->between_steps();
    twin_->step();
  }
  ASSERT_TRUE(twin_->diverged());
  twin_->between_steps();
  const Time stopped = twin_->now();
  save("gravity: [0, 0, -9.81]\n");
  reload();
  twin_->between_steps();
  EXPECT_FALSE(twin_->time_control().paused);
  EXPECT_EQ(twin_->now(), stopped);
  run(0.5);
  EXPECT_THAT(logged_, HasSubstr("the robots are at their start"));
}

// The schedule began with 1 ms; at 2 ms as many steps are twice as long.
TEST_F(EditedWorld, LongerStepDoesNotStallRunnerAndDurationHolds) {
  std::atomic<bool> stop{false};
  Runner runner(*twin_, {.speed = 1.0, .duration = from_seconds(0.6)});
  runner.on_first_step([&] {
    twin_->bus().post([&] {
      save("step: 0.002\n");
      reload();
    });
  });
  const RunStatistics run = runner.run(stop);
  EXPECT_EQ(run.end, RunEnd::duration_reached);
  EXPECT_NEAR(to_seconds(run.simulated), 0.6, 0.003);
  EXPECT_NEAR(to_seconds(twin_->now()), 0.6, 0.003);
  EXPECT_LE(run.steps, 305u);
}

TEST_F(EditedWorld, EndlessBoxIsCleanError) {
  save("");
  std::ofstream(folder_ / "world.yaml")
      << "objects:\n  - {name: a, box: [1e20, 0.4, 0.04], mass: 0}\n"
         "  - {name: b, sphere: {radius: 0.1}, mass: 1e9, xyz: [1e20, 0, 1]}\n";
  try {
    reload();
    FAIL() << "expected the world to be refused";
  } catch (const InputError& refused) {
    EXPECT_THAT(refused.what(),
                AllOf(HasSubstr("world.yaml:2:"), HasSubstr("the side is 1e+20 m; it must be from"),
                      HasSubstr("the mass is 1e+09 kg"), HasSubstr("the distance is 1e+20 m")));
  }
}

TEST(ExtremeCalls, TwinSurvivesSeededCalls) {
  constexpr int kRounds = 30;
  int divergences = 0;
  for (std::uint64_t seed = 1; seed <= kRounds; ++seed) {
    std::mt19937_64 random(seed);
    std::vector<std::uint8_t> bytes(400);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    ExtremeCalls calls(bytes);
    EXPECT_EQ(calls.run(), "") << "seed " << seed;
    divergences += calls.divergences();
  }
  std::printf("%d divergences in %d rounds, seeds 1 to %d\n", divergences, kRounds, kRounds);
}

}  // namespace
}  // namespace doppel::test
