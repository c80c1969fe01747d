#include "doppel/lab/headless_run/headless_run.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace doppel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// At 1 ms.
Scenario scenario_of(const std::string& target, const std::string& gravity = "[0, 0, -9.81]") {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  const std::filesystem::path world =
      std::filesystem::path(testing::TempDir()) / (std::string("headless_") + test->name() + ".yaml");
  std::ofstream(world) << "step: 0.001\ngravity: " << gravity << "\n";
  Scenario scenario;
  scenario.world = world;
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  scenario.robots = {{.target = target}};
  return scenario;
}

// An effort that no controller can command.
void tear(Twin& twin) {
  Instance robot = twin.robot().instance();
  robot.apply_joint_effort(robot.model().find_joint("j1"), 1e200);
}

TEST(HeadlessRun, DurationEndsItAfterItsSteps) {
  const RunResult result = run_headless({scenario_of("lab_arm"), {.duration = from_seconds(0.1)}});
  EXPECT_EQ(result.end, RunEnd::duration_reached) << name_of(result.end);
  EXPECT_EQ(result.steps, 100u);
  EXPECT_EQ(result.simulated, from_seconds(0.1));
  EXPECT_THAT(result.findings, IsEmpty());
  EXPECT_THAT(result.errors, IsEmpty());
}

TEST(HeadlessRun, TwoPartsGiveHashOfOneRun) {
  const Log quiet;
  Diagnostics diagnostics;
  Twin twin(scenario_of("lab_arm"), quiet, diagnostics);
  run_headless(twin, {.duration = from_seconds(0.04)});
  const RunResult rest = run_headless(twin, {.duration = from_seconds(0.06)});
  EXPECT_EQ(rest.steps, 60u);
  EXPECT_EQ(rest.simulated, from_seconds(0.06));
  const RunResult whole = run_headless({scenario_of("lab_arm"), {.duration = from_seconds(0.1)}});
  EXPECT_EQ(rest.state_hash, whole.state_hash);
}

TEST(HeadlessRun, ConditionEndsIt) {
  HeadlessOptions options;
  options.until = [](Twin& twin) { return twin.now() >= time_from_seconds(0.025); };
  const RunResult result = run_headless({scenario_of("lab_arm"), options});
  EXPECT_EQ(result.end, RunEnd::condition_met);
  EXPECT_EQ(result.steps, 25u);
}

TEST(HeadlessRun, ConditionThatHoldsAtStartEndsItWithoutStep) {
  const RunResult result = run_headless({scenario_of("lab_arm"), {.until = [](Twin&) { return true; }}});
  EXPECT_EQ(result.end, RunEnd::condition_met);
  EXPECT_EQ(result.steps, 0u);
}

TEST(HeadlessRun, DivergenceIsFinding) {
  HeadlessOptions options{.duration = from_seconds(1)};
  options.observers = {[](Twin& twin) {
    if (twin.steps() == 10) tear(twin);
  }};
  const RunResult result = run_headless({scenario_of("lab_arm"), options});
  EXPECT_EQ(result.end, RunEnd::diverged);
  EXPECT_EQ(result.steps, 11u) << "expected that nothing steps a diverged twin";
  ASSERT_EQ(result.findings.size(), 1u);
  EXPECT_EQ(result.findings.front().rule, "run.diverged");
  EXPECT_THAT(result.findings.front().message, HasSubstr("the simulation diverges 0.010 s after the start"));
  EXPECT_TRUE(result.findings.front().where.known());
}

TEST(HeadlessRun, CancellationEndsIt) {
  std::atomic<bool> cancel{false};
  HeadlessOptions options{.cancel = &cancel};
  options.observers = {[&cancel](Twin& twin) {
    if (twin.steps() == 7) cancel = true;
  }};
  const RunResult result = run_headless({scenario_of("lab_arm"), options});
  EXPECT_EQ(result.end, RunEnd::stopped);
  EXPECT_EQ(result.steps, 7u);
}

TEST(HeadlessRun, UnknownRobotIsFailureWithItsErrors) {
  const RunResult result = run_headless({scenario_of("lab_arn"), {.duration = from_seconds(1)}});
  EXPECT_EQ(result.end, RunEnd::failed);
  ASSERT_FALSE(result.errors.empty());
  EXPECT_THAT(result.errors.front().message, HasSubstr("lab_arn"));
  EXPECT_THROW(result.throw_if_failed(), InputError);
}

TEST(HeadlessRun, ExceptionOfObserverIsFailure) {
  HeadlessOptions options{.duration = from_seconds(1)};
  options.observers = {[](Twin&) { throw std::runtime_error("the disk is full"); }};
  const RunResult result = run_headless({scenario_of("lab_arm"), options});
  EXPECT_EQ(result.end, RunEnd::failed);
  EXPECT_EQ(result.steps, 1u);
  ASSERT_EQ(result.errors.size(), 1u);
  EXPECT_EQ(result.errors.front().message, "the disk is full");
}

TEST(HeadlessRun, ObserversSeeEachStepInOrder) {
  std::vector<std::string> seen;
  HeadlessOptions options{.duration = from_seconds(0.002)};
  options.observers = {[&](Twin& twin) { seen.push_back("a" + std::to_string(twin.steps())); },
                       [&](Twin& twin) { seen.push_back("b" + std::to_string(twin.steps())); }};
  run_headless({scenario_of("lab_arm"), options});
  EXPECT_THAT(seen, ElementsAre("a1", "b1", "a2", "b2"));
}

TEST(HeadlessRun, PassiveArmThatFallsIsFinding) {
  Scenario scenario = scenario_of("lab_arm", "[5, 5, -8]");
  scenario.start_controllers = false;
  const HeadlessOptions options{.duration = from_seconds(0.5), .at_rest = true};
  const RunResult result = run_headless({scenario, options});
  EXPECT_EQ(result.end, RunEnd::duration_reached);
  ASSERT_FALSE(result.findings.empty());
  EXPECT_EQ(result.findings.front().rule, "run.unrest");
  EXPECT_EQ(result.findings.front().robot, "arm");
}

TEST(HeadlessRun, RunsOnThreadsGiveHashOfOneRunInTheirOrder) {
  std::vector<HeadlessRun> runs;
  for (const char* const robot : {"lab_arm", "rover_skid", "lab_arm", "rover_skid", "lab_arm"})
    runs.push_back({scenario_of(robot), {.duration = from_seconds(0.2)}});
  const std::vector<RunResult> results = run_headless(runs, 5);
  const std::uint64_t arm = run_headless(runs[0]).state_hash, rover = run_headless(runs[1]).state_hash;
  ASSERT_NE(arm, rover);
  std::vector<std::uint64_t> hashes;
  for (const RunResult& result : results) {
    EXPECT_EQ(result.end, RunEnd::duration_reached);
    hashes.push_back(result.state_hash);
  }
  EXPECT_THAT(hashes, ElementsAre(arm, rover, arm, rover, arm));
}

}  // namespace
}  // namespace doppel
