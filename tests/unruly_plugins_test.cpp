// Controllers and hardware of others that throw, block or give NaN: the twin goes on, and reports each.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <mutex>

#include "doppel/twin/assembly/runner.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class UnrulyPlugins : public TwinFixture {
 protected:
  void SetUp() override {
    folder_ = make_folder("unruly");
    log_.add_sink([this](const LogLine& line) {
      const std::lock_guard lock(mutex_);
      logged_ += line.text + '\n';
    });
  }
  void TearDown() override {
    edge_.reset();
    twin_.reset();
    fs::remove_all(folder_);
  }
  std::string logged() {
    const std::lock_guard lock(mutex_);
    return logged_;
  }

  void with_controller(const std::string& fault) {
    std::ofstream(folder_ / "controllers.yaml")
        << "controller_manager:\n  ros__parameters:\n    update_rate: 100\n"
           "    unruly: {type: unruly/Unruly}\nunruly: {ros__parameters: {fault: "
        << fault << "}}\n";
    Scenario scenario;
    scenario.robots = {{.target = "lab_arm"}};
    scenario.robots.front().controllers = {(folder_ / "controllers.yaml").string()};
    scenario.plugins = {DOPPEL_TEST_UNRULY};
    bring_up(scenario);
  }
  void with_hardware(const std::string& fault) {
    std::ofstream(folder_ / "arm.urdf")
        << "<robot name='arm'><link name='base'/><link name='l'><inertial><mass value='1'/><inertia "
           "ixx='0.1' iyy='0.1' "
           "izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='j' type='revolute'><parent "
           "link='base'/>"
           "<child link='l'/><axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='5' velocity='2'/></joint>"
           "<ros2_control name='a' type='system'><hardware><plugin>doppel/Loopback</plugin><param "
           "name='fault'>"
        << fault
        << "</param><param name='fault_at'>5</param><param name='recovers'>false</param></hardware><joint "
           "name='j'>"
           "<command_interface name='position'/><state_interface "
           "name='position'/></joint></ros2_control></robot>";
    bring_up((folder_ / "arm.urdf").string());
  }
  // By the wall clock, as with `doppel up`.
  RunEnd run_for(std::chrono::milliseconds time, std::function<void(const std::string&)> report_stall = {}) {
    std::atomic<bool> stop{false};
    std::thread stopper([&] {
      std::this_thread::sleep_for(time);
      stop = true;
    });
    Runner runner(*twin_, {.speed = 1.0, .duration = {}, .report_stall = std::move(report_stall)});
    const RunEnd end = runner.run(stop).end;
    stopper.join();
    return end;
  }
  void expect_finite() {
    for (const JointSnapshot& joint : twin_->robot().joints())
      EXPECT_TRUE(std::isfinite(joint.q)) << joint.name;
    EXPECT_FALSE(twin_->diverged());
  }

  fs::path folder_;
  std::mutex mutex_;
  std::string logged_;
};

TEST_F(UnrulyPlugins, ThrowingControllerIsDeactivatedAndReported) {
  for (const char* fault : {"throw", "throw_number"}) {
    with_controller(fault);
    run(0.5);
    expect_finite();
    for (const ControllerView& view : twin_->robot().controller_manager().controllers())
      EXPECT_NE(view.state, ControllerState::active) << fault;
    EXPECT_THAT(logged(),
                HasSubstr(std::string(fault) == "throw" ? "no solution" : "other than a std::exception"));
  }
}

TEST_F(UnrulyPlugins, CommandThatIsNotFiniteIsRefusedAndReported) {
  for (const char* fault : {"give_nan", "give_infinity"}) {
    logged_.clear();
    with_controller(fault);
    run(0.5);
    expect_finite();
    EXPECT_THAT(logged(), HasSubstr("j1")) << fault;
  }
}

TEST_F(UnrulyPlugins, BlockingControllerIsReportedByAnotherThread) {
  with_controller("block");
  std::vector<std::string> reports;
  EXPECT_EQ(
      run_for(std::chrono::milliseconds(9000), [&](const std::string& text) { reports.push_back(text); }),
      RunEnd::stopped);
  ASSERT_GE(reports.size(), 2u);
  EXPECT_THAT(reports[0], HasSubstr("the loop has been in one step for 2 s"));
  EXPECT_THAT(reports[1], HasSubstr("the loop goes on"));
  EXPECT_GT(twin_->now(), time_from_seconds(0.5));
}

TEST_F(UnrulyPlugins, FailingHardwareDoesNotEndTwin) {
  for (const std::string fault : {"throw", "error", "late", "nan"}) {
    logged_.clear();
    with_hardware(fault);
    EXPECT_EQ(run_for(std::chrono::milliseconds(600)), RunEnd::stopped) << fault;
    EXPECT_GT(twin_->now(), time_from_seconds(0.2)) << fault;
    EXPECT_NE(logged(), "") << fault << ": expected a report";
    if (fault == "nan") {
      EXPECT_THAT(logged(), HasSubstr("hardware 'a' reads nan of 'j/position'"));
    }
  }
}

// The network starts with the first step, which takes long on a busy machine; nothing was commanded yet.
TEST_F(UnrulyPlugins, SlowStartDoesNotStopRealHardware) {
  with_hardware("wrong");
  const std::atomic<bool> stop{false};
  Runner runner(*twin_, {.speed = 1.0, .duration = std::chrono::milliseconds(5)});
  runner.on_first_step([] { std::this_thread::sleep_for(std::chrono::milliseconds(400)); });
  runner.run(stop);
  EXPECT_FALSE(twin_->robot().controller_manager().is_stopped()) << logged();
}

}  // namespace
}  // namespace doppel::test
