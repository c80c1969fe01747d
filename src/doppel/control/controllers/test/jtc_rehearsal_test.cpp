// Trajectories that a guard rehearses before joint_trajectory_controller follows them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/controllers/test/jtc_rig.h"
#include "doppel/control/manager/command_guard.h"

namespace doppel {
namespace {

using testing::HasSubstr;
using Result = FollowJointTrajectory::Result;

// Rehearses as long as its test wants.
class SlowGuard : public CommandGuard {
 public:
  Status check(const GuardedPath& /*path*/) override { return {}; }
  std::unique_ptr<Rehearsal> rehearse(const GuardedPath& path, Duration period) override {
    ++begun;
    length = to_seconds(path.length);
    rate = 1 / to_seconds(period);
    first.resize(path.joints.size());
    last.resize(path.joints.size());
    EXPECT_TRUE(path.sample(Duration{}, first));
    EXPECT_TRUE(path.sample(path.length, last));
    return std::make_unique<Slow>(*this);
  }
  void begin(std::span<const double> /*positions*/, Duration /*period*/) override {}
  void attend() override {}
  bool permits(std::span<const double> /*positions*/) noexcept override { return true; }

  std::optional<Status> outcome;
  int begun = 0, running = 0;
  double length = 0, rate = 0;
  std::vector<double> first, last;

 private:
  struct Slow : Rehearsal {
    explicit Slow(SlowGuard& its_guard) : guard(its_guard) { ++guard.running; }
    ~Slow() override { --guard.running; }
    std::optional<Status> outcome() override { return guard.outcome; }
    SlowGuard& guard;
  };
};

class JtcRehearsal : public testing::Test {
 protected:
  static JtcOptions options_with(CommandGuard& guard) {
    JtcOptions out;
    out.guard = &guard;
    return out;
  }
  [[nodiscard]] static JointTrajectory way(double a, double stamp = 0) {
    return trajectory(kJoints, {point(1.0, {a, 0, 0})}, stamp);
  }
  SlowGuard guard_;
  JtcRig rig_{options_with(guard_)};
};

TEST_F(JtcRehearsal, GoalMovesNothingUntilItHasPassed) {
  const auto goal = rig_.send(way(1));
  EXPECT_TRUE(rig_.answers[goal].accepted.value_or(false));
  EXPECT_NEAR(guard_.length, 1, 1e-9);
  EXPECT_NEAR(guard_.rate, 1 / to_seconds(rig_.manager->period()), 1e-6);
  EXPECT_EQ(guard_.first[0], 0);
  EXPECT_EQ(guard_.last[0], 1);
  rig_.run_for(2);
  EXPECT_EQ(rig_.command("a/position"), 0);
  guard_.outcome = Status{};
  const double passed = rig_.time();
  rig_.run_for(2);
  EXPECT_EQ(rig_.answers[goal].status, GoalStatus::succeeded) << rig_.answers[goal].result.error_string;
  EXPECT_GE(*rig_.answers[goal].finished_at, passed + 1);
  EXPECT_EQ(rig_.command("a/position"), 1);
  EXPECT_EQ(guard_.running, 0);
}

TEST_F(JtcRehearsal, RefusedGoalIsAbortedWithReasonAndMovesNothing) {
  const auto goal = rig_.send(way(1));
  guard_.outcome = Status::refused("'b' would touch 'base' at 0.40 s");
  rig_.run_for(2);
  EXPECT_EQ(rig_.answers[goal].status, GoalStatus::aborted);
  EXPECT_EQ(rig_.answers[goal].result.error_code, Result::INVALID_GOAL);
  EXPECT_THAT(rig_.answers[goal].result.error_string, HasSubstr("'b' would touch 'base' at 0.40 s"));
  EXPECT_EQ(rig_.command("a/position"), 0);
}

TEST_F(JtcRehearsal, TrajectoryFromTopicWaitsOrIsIgnored) {
  rig_.say(way(1));
  rig_.run_for(1.5);
  EXPECT_EQ(rig_.command("a/position"), 0);
  guard_.outcome = Status{};
  rig_.run_for(1.5);
  EXPECT_EQ(rig_.command("a/position"), 1);
  guard_.outcome = Status::refused("'a' would need more at 0.10 s");
  rig_.say(way(0));
  rig_.run_for(1.5);
  EXPECT_EQ(rig_.command("a/position"), 1);
  EXPECT_EQ(rig_.count(Severity::error, "'a' would need more at 0.10 s; the trajectory is ignored"), 1u);
}

TEST_F(JtcRehearsal, CanceledGoalIsNeverFollowed) {
  const auto goal = rig_.send(way(1));
  rig_.cancel(goal);
  EXPECT_EQ(guard_.running, 0);
  guard_.outcome = Status{};
  rig_.run_for(2);
  EXPECT_EQ(rig_.answers[goal].status, GoalStatus::canceled);
  EXPECT_EQ(rig_.command("a/position"), 0);
}

TEST_F(JtcRehearsal, NewGoalReplacesOneThatWaits) {
  const auto first = rig_.send(way(1)), second = rig_.send(way(-1));
  EXPECT_EQ(rig_.answers[first].status, GoalStatus::aborted);
  EXPECT_EQ(guard_.running, 1);
  guard_.outcome = Status{};
  rig_.run_for(2);
  EXPECT_EQ(rig_.answers[second].status, GoalStatus::succeeded);
  EXPECT_EQ(rig_.command("a/position"), -1);
}

TEST_F(JtcRehearsal, DeactivationEndsWaitingGoal) {
  const auto goal = rig_.send(way(1));
  ASSERT_TRUE(rig_.deactivate());
  EXPECT_EQ(guard_.running, 0);
  EXPECT_EQ(rig_.answers[goal].status, GoalStatus::aborted);
  guard_.outcome = Status{};
  ASSERT_TRUE(rig_.activate());
  rig_.run_for(2);
  EXPECT_EQ(rig_.command("a/position"), 0);
}

// The present goal goes on meanwhile, so that the new one is rehearsed again from where the robot is.
TEST_F(JtcRehearsal, RehearsalFromElsewhereIsRepeated) {
  guard_.outcome = Status{};
  const auto first = rig_.send(trajectory(kJoints, {point(2.0, {2, 0, 0})}));
  rig_.run_for(0.5);
  guard_.outcome.reset();
  const auto second = rig_.send(way(0));
  const int begun = guard_.begun;
  rig_.run_for(0.5);
  EXPECT_FALSE(rig_.answers[first].finished_at);
  const double stopped_at = rig_.command("a/position");
  EXPECT_GT(stopped_at, 0.7);
  guard_.outcome = Status{};
  rig_.run_for(0.1);
  EXPECT_GT(guard_.begun, begun);
  rig_.run_for(3);
  EXPECT_EQ(rig_.answers[first].status, GoalStatus::aborted) << "the new goal has replaced it";
  EXPECT_EQ(rig_.answers[second].status, GoalStatus::succeeded);
  EXPECT_EQ(rig_.command("a/position"), 0);
}

// Otherwise the robot would jump into the middle of its trajectory.
TEST_F(JtcRehearsal, StampMovesByTimeOfRehearsal) {
  rig_.send(way(1, rig_.time()));
  rig_.run_for(0.5);
  guard_.outcome = Status{};
  double before = 0, largest = 0;
  for (int i = 0; i < 200; ++i) {
    rig_.run(1);
    largest = std::max(largest, std::abs(rig_.command("a/position") - before));
    before = rig_.command("a/position");
  }
  EXPECT_EQ(before, 1);
  EXPECT_LT(largest, 0.03);
}

}  // namespace
}  // namespace doppel
