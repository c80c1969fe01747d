// Edits from another thread while the loop runs, and what happens to them when the reloader is destroyed.
#include "doppel/session/live/reload.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <future>
#include <mutex>
#include <thread>

#include "doppel/base/core/abandoned_thread.h"
#include "doppel/session/live/detail/edited_files.h"
#include "doppel/session/live/health_publisher.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using ::testing::HasSubstr;
using ::testing::Not;

class ReloadTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / "session" / info->name() / "omarm_one";
    fs::remove_all(folder_);
    fs::create_directories(folder_.parent_path());
    log_.add_sink([this](const LogLine& line) {
      const std::lock_guard lock(mutex_);
      said_ += line.text + '\n';
    });
  }
  void TearDown() override { fs::remove_all(folder_.parent_path()); }

  std::string said() {
    const std::lock_guard lock(mutex_);
    return said_;
  }
  // A reloadable whose file is <folder>/watched, and that is recreated by `begin`.
  Reloadable watched(Bus& bus, std::function<void()> begin) {
    fs::create_directories(folder_);
    save("watched", "1");
    return {bus, [this] { return std::vector{folder_ / "watched"}; },
            [begin = std::move(begin)]() -> Reloadable::Build {
              begin();
              return [](Diagnostics&) -> Reloadable::TakeOver { return [] { return "taken"; }; };
            },
            nullptr};
  }
  void save(const std::string& file, const std::string& text) { std::ofstream(folder_ / file) << text; }

  fs::path folder_;
  std::mutex mutex_;
  std::string said_;
  Log log_;
};

TEST_F(ReloadTest, TaskNotBegunAtShutdownNeverRuns) {
  Bus bus;
  int begun = 0;
  {
    const Reloader reloader(watched(bus, [&] { ++begun; }), log_);
    save("watched", "2");
    ASSERT_TRUE(bus.wait(seconds(20))) << "expected the edit to be noticed";
  }
  bus.spin();
  EXPECT_EQ(begun, 0);
}

TEST_F(ReloadTest, ShutdownWaitsForBegunTask) {
  Bus bus;
  std::atomic<bool> begun{false}, done{false};
  auto reloader = std::make_unique<Reloader>(watched(bus,
                                                     [&] {
                                                       begun = true;
                                                       std::this_thread::sleep_for(milliseconds(200));
                                                       done = true;
                                                     }),
                                             log_);
  std::thread end([&] {
    while (!begun) std::this_thread::yield();
    reloader.reset();
    EXPECT_TRUE(done);
  });
  save("watched", "2");
  ASSERT_TRUE(bus.wait(seconds(20))) << "expected the edit to be noticed";
  bus.spin();
  end.join();
}

// A build that does not end is reported, replaced by that of a new edit, and not waited for at the end.
TEST_F(ReloadTest, EndlessBuildIsReportedAndAbandoned) {
  Bus bus;
  std::atomic<bool> ends{false};
  std::atomic<int> builds{0}, ended{0};
  Reloadable what = watched(bus, [] {});
  what.begin = [&]() -> Reloadable::Build {
    return [&](Diagnostics&) -> Reloadable::TakeOver {
      const bool endless = ++builds != 2;
      while (endless && !ends) std::this_thread::sleep_for(milliseconds(5));
      ++ended;
      return [] { return "taken"; };
    };
  };
  const auto until = [&](const std::string& text) {
    for (const auto end = steady_clock::now() + seconds(60); steady_clock::now() < end;) {
      bus.wait(milliseconds(5));
      bus.spin();
      if (said().find(text) != std::string::npos) return true;
    }
    return false;
  };
  {
    const Reloader reloader(std::move(what), log_);
    save("watched", "2");
    EXPECT_TRUE(until("watched takes long to read"));
    save("watched", "3");
    EXPECT_TRUE(until("watched applied in"));
    save("watched", "4");
    for (const auto end = steady_clock::now() + seconds(20); builds < 3 && steady_clock::now() < end;) {
      bus.wait(milliseconds(5));
      bus.spin();
    }
    EXPECT_EQ(builds, 3);
  }
  EXPECT_EQ(ended, 1) << "expected the end not to wait";
  EXPECT_TRUE(has_abandoned_thread());
  ends = true;
  while (ended < 3) std::this_thread::sleep_for(milliseconds(5));
}

TEST_F(ReloadTest, EditReadWhileRobotsChangeIsReadAgain) {
  Bus bus;
  int taken = 0;
  Reloadable what = watched(bus, [] {});
  what.begin = [&]() -> Reloadable::Build {
    return [&](Diagnostics&) -> Reloadable::TakeOver {
      return [&]() -> std::string {
        if (++taken == 1) throw InputError("reload.robots_changed", {}, "a robot was added");
        return "taken";
      };
    };
  };
  const Reloader reloader(std::move(what), log_);
  save("watched", "2");
  for (const auto end = steady_clock::now() + seconds(20); taken < 2 && steady_clock::now() < end;) {
    bus.wait(milliseconds(5));
    bus.spin();
  }
  EXPECT_EQ(taken, 2);
  EXPECT_THAT(said(), Not(HasSubstr("cannot be used")));
}

TEST_F(ReloadTest, FileThatIsSavedWhileItIsReadIsReadAgain) {
  Bus bus;
  std::atomic<int> builds{0};
  Reloadable what = watched(bus, [] {});
  what.begin = [&]() -> Reloadable::Build {
    return [&](Diagnostics&) -> Reloadable::TakeOver {
      if (++builds == 1) throw InputError(kEditedMeanwhile, {}, "it was saved again while it was read");
      return [] { return "taken"; };
    };
  };
  const Reloader reloader(std::move(what), log_);
  save("watched", "2");
  const auto is_applied = [&] { return said().find("watched applied in") != std::string::npos; };
  for (const auto end = steady_clock::now() + seconds(20); !is_applied() && steady_clock::now() < end;) {
    bus.wait(milliseconds(5));
    bus.spin();
  }
  EXPECT_TRUE(is_applied()) << said();
  EXPECT_EQ(builds, 2);
  EXPECT_THAT(said(), Not(HasSubstr("cannot be used")));
}

// What `doppel up` does, without its server: the loop, the watcher, the thread that judges edits and an edge,
// one thread each.
class RunningTwin : public ReloadTest {
 protected:
  void SetUp() override {
    ReloadTest::SetUp();
    fs::copy(DOPPEL_SOURCE_DIR "/robots/omarm_one", folder_, fs::copy_options::recursive);
    Scenario scenario;
    scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
    scenario.robots = {{.target = folder_.string()}};
    Diagnostics diagnostics;
    twin_ = std::make_unique<Twin>(scenario, log_, diagnostics);
  }

  void edit(const std::string& file, const std::string& from, const std::string& to) {
    std::ifstream in(folder_ / file);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << "expected '" << from << "' in " << file;
    save(file, text.replace(at, from.size(), to));
  }
  // Waits until the log contains it; the loop keeps running meanwhile.
  ::testing::AssertionResult is_said(const std::string& text) {
    for (const auto end = steady_clock::now() + seconds(60); steady_clock::now() < end;) {
      twin_->between_steps();
      twin_->step();
      if (said().find(text) != std::string::npos) return ::testing::AssertionSuccess();
    }
    return ::testing::AssertionFailure() << "'" << text << "' is expected in the log; it contains:\n"
                                         << said();
  }

  std::unique_ptr<Twin> twin_;
};

TEST_F(RunningTwin, EditsAreAppliedAndBrokenEditIsRefused) {
  std::atomic<int> audits{0};
  HealthPublisher health(twin_->bus(), "", [&] { return std::to_string(++audits); });
  const auto look = [&] { health.look_at(twin_->robot().description()); };
  look();
  std::atomic<bool> ends{false};
  std::atomic<int> received{0};
  std::thread listener([&, edge = twin_->bus().attach("/listener")] {
    for (const TopicInfo& topic : twin_->bus().topics()) edge->subscribe(topic.id);
    Edge::Incoming message;
    while (!ends) {
      while (edge->next(message)) ++received;
      edge->wait(milliseconds(10));
    }
  });
  {
    const Reloader reloader(reloadable(
                                *twin_, [](const Twin::Replacement&) {}, look),
                            log_);
    edit("urdf/omarm.xacro", "velocity=\"5.2\"", "velocity=\"4.4\"");
    EXPECT_TRUE(is_said("joints and controllers kept their state"));
    edit("urdf/omarm.xacro", "<mimic joint=\"Revolute 8\"", "<mimic joint=\"Revolute 88\"");
    EXPECT_TRUE(is_said("omarm.xacro cannot be used; the previous model keeps running"));
    edit("urdf/omarm.xacro", "<mimic joint=\"Revolute 88\"", "<mimic joint=\"Revolute 8\"");
    edit("config/ros2_controllers.yaml", "update_rate: 100", "update_rate: 200");
    EXPECT_TRUE(is_said("controllers were recreated"));
  }
  ends = true;
  listener.join();
  EXPECT_GT(received, 0);
  EXPECT_GT(audits, 0);
}

// The version that the build has read counts, and not the one that is there at its end: the journal would
// have bytes that nothing was built from.
TEST_F(RunningTwin, FileThatIsSavedDuringBuildIsRefused) {
  constexpr int kMaxSaves = 20;  // on a busy machine a save may come behind its build
  const Reloadable what = reloadable(*twin_, [](const Twin::Replacement&) {}, {});
  const std::vector<fs::path> files = twin_->files();
  const auto file =
      std::ranges::find_if(files, [](const fs::path& one) { return one.filename() == "omarm.xacro"; });
  ASSERT_NE(file, files.end());
  std::string refusal;
  for (int i = 0; i < kMaxSaves && refusal.empty(); ++i) {
    static_cast<void>(what.files_read->take());
    std::future<void> built = std::async(std::launch::async, [build = what.begin()] {
      Diagnostics found;
      static_cast<void>(build(found));
    });
    while (!what.files_read->take().contains(*file) &&
           built.wait_for(milliseconds(0)) != std::future_status::ready)
      std::this_thread::yield();
    std::ofstream(*file, std::ios::app) << "<!-- saved again -->";
    try {
      built.get();
    } catch (const InputError& error) {
      refusal = error.diagnostics().front().rule;
    }
  }
  EXPECT_EQ(refusal, kEditedMeanwhile);
}

}  // namespace
}  // namespace doppel
