// The loop's meter, and what /doppel/status and /diagnostics report about a run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "doppel/ros/messages/codec.h"
#include "doppel/twin/assembly/runner.h"

namespace doppel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

TEST(LoopMeter, AveragesArePerStepOfLastWindow) {
  LoopMeter meter;
  const LoopMeter::WallTime begin{};
  LoopPhases phases;
  phases.physics = milliseconds(7);  // before this window
  meter.restart(begin, 10, phases);
  phases.physics += milliseconds(50);
  phases.idle += milliseconds(400);
  EXPECT_FALSE(meter.update(begin + milliseconds(499), 510, phases, Duration(1'000'000)));
  EXPECT_FALSE(meter.averages().known);
  ASSERT_TRUE(meter.update(begin + milliseconds(500), 510, phases, Duration(1'000'000)));
  EXPECT_TRUE(meter.averages().known);
  EXPECT_DOUBLE_EQ(meter.averages().real_time_factor, 1.0);
  EXPECT_DOUBLE_EQ(meter.averages().physics, 100.0);
  EXPECT_DOUBLE_EQ(meter.averages().idle, 800.0);
  meter.restart(begin + milliseconds(900), 600, phases);
  EXPECT_FALSE(meter.averages().known);
}

class StatusPublisherTest : public ::testing::Test {
 protected:
  StatusPublisherTest() : publisher_(bus_, "arm", now_), edge_(bus_.attach("test")) {
    for (const TopicInfo& topic : bus_.topics()) {
      ids_[topic.name] = topic.id;
      edge_->subscribe(topic.id);
    }
    bus_.spin();
  }
  void publish() { publisher_.publish_due({sim_, steps_, control_, meter_, run_, {}}, now_); }
  template <class M>
  std::vector<M> received(const std::string& topic) {
    std::vector<M> out;
    Edge::Incoming incoming;
    while (edge_->next(incoming)) {
      if (incoming.topic != ids_.at(topic)) continue;
      EXPECT_TRUE(from_cdr(incoming.cdr, out.emplace_back()).ok());
    }
    return out;
  }

  Bus bus_;
  LoopMeter::WallTime now_{std::chrono::seconds(100)};
  StatusPublisher publisher_;
  std::unique_ptr<Edge> edge_;
  std::map<std::string, TopicId> ids_;
  TimeControl control_;
  LoopMeter meter_;
  RunStatistics run_;
  Time sim_{};
  std::uint64_t steps_ = 0;
};

using doppel_msgs::msg::TwinStatus;

TEST_F(StatusPublisherTest, StatusIsPublishedAtFourHzAndOnChange) {
  publish();
  for (int i = 0; i < 1000; ++i) {
    now_ += milliseconds(1);
    sim_ += Duration(1'000'000);
    publish();
  }
  EXPECT_EQ(received<TwinStatus>("/doppel/status").size(), 5u);
  control_.paused = true;
  publish();
  control_.speed = 2.0;
  publish();
  sim_ = Time{};
  publish();
  publish();
  const auto changes = received<TwinStatus>("/doppel/status");
  ASSERT_EQ(changes.size(), 3u);
  EXPECT_TRUE(changes[0].paused);
  EXPECT_EQ(changes[1].speed, 2.0);
  EXPECT_EQ(changes[2].sim_time, 0.0);
  EXPECT_NEAR(changes[2].wall_time, 1.0, 1e-9);
  for (int i = 0; i < 500; ++i) {
    now_ += milliseconds(2);
    publish();
  }
  EXPECT_EQ(received<TwinStatus>("/doppel/status").size(), 4u) << "expected a status while paused, too";
}

TEST_F(StatusPublisherTest, DivergenceIsPublishedAtOnceAndUntilItIsOver) {
  publish();
  control_.divergence = "the physics diverged in step 7";
  publish();
  control_.divergence.clear();
  publish();
  const auto all = received<TwinStatus>("/doppel/status");
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[1].divergence, "the physics diverged in step 7");
  EXPECT_EQ(all[2].divergence, "");
}

TEST_F(StatusPublisherTest, SkippedStepsAreCounted) {
  bus_.add_skipped(3);
  publish();
  EXPECT_EQ(received<TwinStatus>("/doppel/status").front().skipped, 3u);
}

TEST_F(StatusPublisherTest, DiagnosticsWarnOfOverrunsAndSlowLoop) {
  using diagnostic_msgs::msg::DiagnosticArray;
  using diagnostic_msgs::msg::DiagnosticStatus;
  const auto next = [&] {
    now_ += milliseconds(1001);
    publish();
    const auto all = received<DiagnosticArray>("/diagnostics");
    EXPECT_EQ(all.size(), 1u);
    return all.at(0).status.at(0);
  };
  EXPECT_EQ(next().level, DiagnosticStatus::OK) << "expected OK: there is no measurement yet";
  run_.overruns = 2;
  EXPECT_EQ(next().level, DiagnosticStatus::WARN);
  const DiagnosticStatus calm = next();
  EXPECT_EQ(calm.level, DiagnosticStatus::OK) << "expected OK: there are no new overruns";
  EXPECT_EQ(calm.name, "doppel: loop");
  EXPECT_EQ(calm.hardware_id, "arm");
  meter_.restart(now_, 0, {});
  ASSERT_TRUE(meter_.update(now_ + milliseconds(1000), 900, {}, Duration(1'000'000)));
  const DiagnosticStatus slow = next();
  EXPECT_EQ(slow.level, DiagnosticStatus::WARN);
  EXPECT_THAT(slow.message, ::testing::HasSubstr("0.90 x real time instead of 1"));
  control_.paused = true;
  EXPECT_EQ(next().level, DiagnosticStatus::OK);
  control_.divergence = "the physics diverged in step 7";
  const DiagnosticStatus diverged = next();
  EXPECT_EQ(diverged.level, DiagnosticStatus::ERROR);
  EXPECT_EQ(diverged.message, "paused: the physics diverged in step 7");
}

// A run of a bundled robot, observed from another thread.
TEST(Runner, StatusReportsTimeOfPhases) {
  Log log;
  Diagnostics diagnostics;
  Scenario scenario;
  scenario.robots = {{.target = "lab_arm"}};
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  Twin twin(scenario, log, diagnostics);
  ::doppel::Runner runner(twin, {.speed = 1.0, .duration = from_seconds(0.8)});
  const auto edge = twin.bus().attach("test");
  std::vector<TwinStatus> received;
  for (const TopicInfo& topic : twin.bus().topics()) {
    if (topic.name == "/doppel/status") edge->subscribe(topic.id);
  }
  const std::atomic<bool> stop{false};
  const RunStatistics run = runner.run(stop);
  Edge::Incoming incoming;
  while (edge->next(incoming)) EXPECT_TRUE(from_cdr(incoming.cdr, received.emplace_back()).ok());
  ASSERT_GE(received.size(), 3u);
  const TwinStatus& last = received.back();
  EXPECT_FALSE(last.paused);
  EXPECT_GT(last.time_physics, 0.0);
  EXPECT_GT(last.time_control, 0.0);
  EXPECT_GT(last.time_idle, 0.0);
  EXPECT_GT(last.time_bus, 0.0);
  // The phases of a step add up to the time of a step, us, if the machine is fast enough.
  const double sum =
      last.time_control + last.time_physics + last.time_publish + last.time_bus + last.time_idle;
  EXPECT_NEAR(sum * last.real_time_factor, to_seconds(twin.step_size()) * 1e6, 50.0);
  EXPECT_EQ(run.end, RunEnd::duration_reached);
}

// A request for very many steps must not block other users of the loop.
TEST(Runner, StopInterruptsOwedSteps) {
  Log log;
  Diagnostics diagnostics;
  Scenario scenario;
  scenario.robots = {{.target = "lab_arm"}};
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  Twin twin(scenario, log, diagnostics);
  ::doppel::Runner runner(twin, {.speed = 1.0, .duration = {}});
  twin.time_control().paused = true;
  twin.time_control().steps_owed = UINT64_MAX;
  std::atomic<bool> stop{false};
  std::thread stopper([&] {
    std::this_thread::sleep_for(milliseconds(50));
    stop = true;
  });
  EXPECT_EQ(runner.run(stop).end, RunEnd::stopped);
  stopper.join();
  EXPECT_GT(twin.steps(), 0u);
}

}  // namespace
}  // namespace doppel
