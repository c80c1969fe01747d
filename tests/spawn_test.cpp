// A robot that is spawned while others run: slow work is done outside of the loop, and a failure during it
// changes nothing.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "doppel/base/core/abandoned_thread.h"
#include "doppel/base/core/thrown.h"
#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/twin/loop/twin_core.h"
#include "doppel/twin/spawn/robot_spawner.h"
#include "faults.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

// A build that was abandoned may go on while the process ends, which then runs no static destructors, as the
// program does (abandoned_thread.h).
class EndWithAbandonedThread : public testing::EmptyTestEventListener {
  void OnTestProgramEnd(const testing::UnitTest& all) override {
    if (!has_abandoned_thread()) return;
    std::fflush(nullptr);
    std::_Exit(all.Passed() ? 0 : 1);
  }
};
const bool is_listening = [] {
  testing::UnitTest::GetInstance()->listeners().Append(new EndWithAbandonedThread);
  return true;
}();

class SpawnTest : public TwinFixture {
 protected:
  void SetUp() override {
    register_faulty_engine();
    xml_ = Twin(scenario(""), log_, diagnostics_).robot().description().xml;
    bring_up(scenario("first"));
    run(0.05);
  }
  static Scenario scenario(const std::string& name_space) {
    Scenario out;
    out.robots = {{.target = "lab_arm", .name_space = name_space}};
    out.engine = "faulty";
    out.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
    return out;
  }
  // The loop has received the call when this returns.
  void ask_for_guest() {
    gazebo_msgs::srv::SpawnEntity::Request request;
    request.name = request.robot_namespace = "guest";
    request.initial_pose.position.x = 3;
    request.initial_pose.orientation.w = 1;
    request.xml = xml_;
    answer_ = {};
    answered_ = false;
    edge_->call("/spawn_entity", to_cdr(request), [this](Status status, Bytes cdr) {
      answered_ = true;
      EXPECT_TRUE(status.ok() && from_cdr(cdr, answer_).ok()) << status.why();
    });
    twin_->between_steps();
  }
  // `each`: before each pass of the loop.
  template <typename Each>
  void run_until_answered(const Each& each) {
    for (int i = 0; i < 3000 && !answered_; ++i) {
      each();
      run(0.001);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    EXPECT_TRUE(answer_.success) << answer_.status_message;
  }

  // The nth fault of the kind is injected while the robot is spawned, until spawning succeeds.
  void expect_that_refusals_change_nothing(Fault kind) {
    WorldRobot asked;
    asked.name_space = "guest";
    asked.X_WR = make_pose({3, 0, 0}, {0, 0, 0});
    const auto joining = Twin::prepare_robot(twin_->running(), asked, xml_, diagnostics_);
    Twin undisturbed(scenario("first"), log_, diagnostics_);
    while (undisturbed.now() < twin_->now()) {
      undisturbed.between_steps();
      undisturbed.step();
    }
    const std::vector<std::string> nodes = twin_->bus().nodes();
    int refused = 0;
    for (std::uint64_t n = 1; twin_->find_robot("guest") == nullptr && n < 1000; ++n) {
      SCOPED_TRACE(n);
      arm(kind, n);
      try {
        twin_->add_robot(joining);
        disarm();
      } catch (...) {
        disarm();
        ++refused;
        ASSERT_EQ(twin_->robots().size(), 1u) << thrown_text();
        ASSERT_EQ(twin_->engine().world().instances().size(), 1u);
        ASSERT_EQ(twin_->bus().nodes(), nodes);
        for (Twin* const twin : {twin_.get(), &undisturbed}) {
          twin->between_steps();
          twin->step();
        }
        ASSERT_EQ(twin_->state_hash(), undisturbed.state_hash());
      }
    }
    EXPECT_GT(refused, 0);
    EXPECT_NE(twin_->find_robot("guest"), nullptr);
  }

  std::string xml_;
  gazebo_msgs::srv::SpawnEntity::Response answer_;
  bool answered_ = false;
};

TEST_F(SpawnTest, CompilationRunsOutsideLoop) {
  const std::uint64_t before = compilations_here();
  ask_for_guest();
  run_until_answered([] {});
  EXPECT_NE(twin_->find_robot("guest"), nullptr);
  EXPECT_EQ(compilations_here(), before);
}

TEST_F(SpawnTest, ChangedWorldIsCompiledAgainOutsideLoop) {
  ask_for_guest();
  spawn_ball("ball", {-3, 0, 1});
  const std::uint64_t before = compilations_here();
  run_until_answered([] {});
  EXPECT_NE(twin_->find_robot("guest"), nullptr);
  EXPECT_TRUE(twin_->engine().find("ball"));
  EXPECT_EQ(compilations_here(), before);
}

TEST_F(SpawnTest, SpawnSucceedsInChangingWorld) {
  ask_for_guest();
  int balls = 0;
  run_until_answered([&] {
    if (balls > 0) twin_->engine().remove("ball_" + std::to_string(balls));
    spawn_ball("ball_" + std::to_string(++balls), {-3, 0, 1});
  });
  EXPECT_NE(twin_->find_robot("guest"), nullptr);
  EXPECT_TRUE(twin_->engine().find("ball_" + std::to_string(balls)));
}

TEST_F(SpawnTest, TwinEndsWithoutBuildThatHangs) {
  hang_compilations(true);
  ask_for_guest();
  edge_.reset();
  twin_.reset();
  EXPECT_TRUE(has_abandoned_thread());
  EXPECT_FALSE(answered_);
  hang_compilations(false);
}

// The deadline is over at once here, so that no build is waited for.
TEST_F(SpawnTest, RobotIsRefusedWhileTwoEarlierOnesAreBuilt) {
  TwinCore core(scenario(""), log_, diagnostics_);
  hang_compilations(true);
  std::vector<std::string> answers;
  {
    RobotSpawner spawner(core, std::chrono::milliseconds(0));
    for (const char* name : {"first", "second", "third"}) {
      WorldRobot robot;
      robot.name_space = name;
      spawner.spawn(robot, xml_, [&answers, name](const Status& status) {
        answers.push_back(fmt::format("{}: {}", name, status.ok() ? "spawned" : status.why()));
      });
    }
    hang_compilations(false);
  }
  EXPECT_THAT(answers,
              testing::ElementsAre(testing::HasSubstr("first: the robot took longer than 0 s to build"),
                                   testing::HasSubstr("third: 2 earlier robots are still being built")));
}

TEST_F(SpawnTest, EngineFailureChangesNothing) {
  expect_that_refusals_change_nothing(Fault::engine);
}

TEST_F(SpawnTest, OutOfMemoryChangesNothing) {
  expect_that_refusals_change_nothing(Fault::allocation);
}

}  // namespace
}  // namespace doppel::test
