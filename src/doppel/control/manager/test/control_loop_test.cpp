// A control loop on its own thread and on wall-clock time: it keeps its period during slow work, counts
// missed cycles, and is supervised. With asynchronous hardware it does not wait for the device.

#include "doppel/control/manager/control_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <system_error>
#include <thread>

#include "doppel/base/core/test/system_faults.h"
#include "doppel/control/controllers/builtin.h"
#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using Names = std::vector<std::string>;

constexpr const char* kGroupController = R"(controller_manager:
  ros__parameters:
    update_rate: 200
    g: {type: velocity_controllers/JointGroupVelocityController}
g: {ros__parameters: {joints: [a]}}
)";

HardwareDescription loopback(const std::vector<std::pair<std::string, std::string>>& params) {
  HardwareDescription out;
  out.name = "Loop";
  out.type = "system";
  out.plugin = "doppel/Loopback";
  out.params = params;
  HardwareJointDescription joint;
  joint.name = "a";
  joint.command_interfaces.resize(1);
  joint.command_interfaces[0].name = kVelocity;
  joint.state_interfaces.resize(2);
  joint.state_interfaces[0].name = kPosition;
  joint.state_interfaces[1].name = kVelocity;
  out.joints = {joint};
  return out;
}

struct LoopRig {
  explicit LoopRig(const HardwareDescription& description, ControlLoopOptions options = {})
      : model(fake_robot({{"a"}})), file(ParameterFile::parse(kGroupController, "test.yaml")) {
    log.add_sink([this](const LogLine& line) {
      const std::lock_guard lock(mutex);
      said += line.text + "\n";
    });
    manager = std::make_unique<ControllerManager>(bus, model, registry, &file, ControllerManagerOptions{},
                                                  log, diagnostics);
    EXPECT_TRUE(manager->add_hardware(HardwareRegistry::with_builtin().find(description.plugin)->make(),
                                      description, diagnostics));
    manager->start(Names{"g"});
    options.lock_memory = false;
    loop = std::make_unique<ControlLoop>(*manager, gate, Time{}, options, log);
  }
  // What the other thread does in the meantime.
  void attend_for(milliseconds wall) {
    const auto end = std::chrono::steady_clock::now() + wall;
    while (std::chrono::steady_clock::now() < end) {
      {
        const std::lock_guard held(gate);
        bus.spin();
        loop->attend();
        manager->housekeeping(Time(std::chrono::steady_clock::now() - begin));
      }
      std::this_thread::sleep_for(milliseconds(1));
    }
  }
  // Until `done` (evaluated under the gate) holds; on a busy machine this can take long.
  template <class Done>
  bool attend_until(const Done& done) {
    for (int i = 0; i < 2000; ++i) {
      attend_for(milliseconds(10));
      if (look(done)) return true;
    }
    return false;
  }
  template <class Look>
  auto look(const Look& at) {
    const std::lock_guard held(gate);
    return at();
  }
  Bus bus;
  Model model;
  ControllerRegistry registry = builtin_controllers();
  std::mutex mutex;
  std::string said;
  Log log;
  Diagnostics diagnostics;
  ParameterFile file;
  LoopGate gate;
  std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
  std::unique_ptr<ControllerManager> manager;
  std::unique_ptr<ControlLoop> loop;
};

TEST(ControlLoopTest, RateIsKeptDuringMessagesAndSwitches) {
  LoopRig rig(loopback({}));
  Node speaker(rig.bus, "/speaker");
  const auto commands = speaker.advertise<std_msgs::msg::Float64MultiArray>("/g/commands");
  for (int i = 0; i < 10; ++i) {
    rig.look([&] {
      commands.publish({{}, {0.5}}, Time{});
      EXPECT_TRUE(rig.manager->switch_controllers({}, Names{"g"}, Strictness::strict).ok());
      EXPECT_TRUE(rig.manager->switch_controllers(Names{"g"}, {}, Strictness::strict).ok());
      commands.publish({{}, {0.5}}, Time{});
    });
    rig.attend_for(milliseconds(50));
  }
  EXPECT_TRUE(rig.attend_until([&] { return rig.loop->statistics().ticks > 100; }));
  const auto most = (std::chrono::steady_clock::now() - rig.begin) / rig.manager->period();
  EXPECT_LE(rig.look([&] { return rig.loop->statistics().ticks; }), static_cast<std::uint64_t>(most) + 1);
  EXPECT_TRUE(rig.attend_until([&] { return rig.manager->state("a/position") > 0.05; }));
}

TEST(ControlLoopTest, SlowReadIsReportedAsOverrun) {
  LoopRig rig(loopback({{"fault", "late"}, {"fault_size", "0.012"}}));
  diagnostic_msgs::msg::DiagnosticStatus manager_status;
  Node listener(rig.bus, "/listener");
  listener.subscribe<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", [&](const auto& message) {
    for (const auto& status : message.status) {
      if (status.name == "controller_manager: Controller Manager Activity") manager_status = status;
    }
  });
  EXPECT_TRUE(rig.attend_until([&] {
    return rig.loop->statistics().overruns > 20 &&
           manager_status.message == "Controller Manager has bad periodicity";
  })) << manager_status.message;
  const LoopStatistics statistics = rig.look([&] { return rig.loop->statistics(); });
  EXPECT_GE(statistics.longest, 0.012);
  const std::lock_guard lock(rig.mutex);
  EXPECT_THAT(rig.said,
              HasSubstr("Overrun detected! The controller manager missed its desired rate of 200 Hz"));
}

TEST(ControlLoopTest, StalledLoopStopsHardware) {
  ControlLoopOptions options;
  options.stall = milliseconds(60);
  LoopRig rig(loopback({{"fault", "late"}, {"fault_size", "0.3"}, {"fault_at", "100"}, {"fault_for", "1"}}),
              options);
  EXPECT_TRUE(rig.attend_until([&] { return rig.manager->is_stopped(); }));
  const std::lock_guard lock(rig.mutex);
  EXPECT_THAT(rig.said, HasSubstr("emergency stop by watchdog: the control loop was blocked for"));
}

// The work of the program between the start of the loop and its first command may take long, for example
// joining the network.
TEST(ControlLoopTest, GateHeldDuringStartIsNoStall) {
  ControlLoopOptions options;
  options.stall = milliseconds(1000);
  LoopRig rig(loopback({}), options);
  const auto ticks = [&] { return rig.loop->statistics().ticks; };
  const std::uint64_t before = rig.look([&] {
    const std::uint64_t out = ticks();
    std::this_thread::sleep_for(milliseconds(1600));
    return out;
  });
  // The tick that waited for the gate is one of the start, and each later one may be late on a busy machine.
  for (int i = 0; i < 20'000 && rig.look(ticks) == before; ++i) std::this_thread::sleep_for(milliseconds(1));
  rig.look([&] { rig.loop->attend(); });
  EXPECT_FALSE(rig.look([&] { return rig.manager->is_stopped(); }));
  {
    const std::lock_guard lock(rig.mutex);
    EXPECT_THAT(rig.said, testing::Not(HasSubstr("Overrun")));
  }
  rig.look([] { std::this_thread::sleep_for(milliseconds(1600)); });
  EXPECT_TRUE(rig.attend_until([&] { return rig.manager->is_stopped(); })) << "later it is one";
}

// Hobby servos get their torque one after another.
TEST(ControlLoopTest, LongActivationIsNoStall) {
  ControlLoopOptions options;
  options.stall = milliseconds(1000);
  LoopRig rig(loopback({}), options);
  rig.attend_for(milliseconds(50));
  rig.look([&] {
    EXPECT_TRUE(rig.manager->switch_controllers({}, Names{"g"}, Strictness::strict));
    EXPECT_TRUE(rig.manager->set_hardware_state("Loop", HardwareState::inactive));
    std::this_thread::sleep_for(milliseconds(1600));
    EXPECT_TRUE(rig.manager->set_hardware_state("Loop", HardwareState::active));
  });
  rig.attend_for(milliseconds(50));
  EXPECT_FALSE(rig.look([&] { return rig.manager->is_stopped(); })) << rig.said;
}

TEST(ControlLoopTest, ErrorInLoopIsHandledOnOtherThread) {
  LoopRig rig(loopback({{"fault", "throw"}, {"fault_at", "10"}}));
  EXPECT_TRUE(
      rig.attend_until([&] { return rig.manager->hardware().front().state == HardwareState::unconfigured; }));
  EXPECT_EQ(rig.look([&] { return rig.manager->controllers().front().state; }), ControllerState::inactive);
}

TEST(ControlLoopTest, ThreadThatCannotStartEndsConstructionWithError) {
  for (const int allowed : {0, 1}) {
    LoopRig rig(loopback({}));
    rig.loop.reset();
    const ThreadShortage shortage(allowed);
    ControlLoopOptions options;
    options.lock_memory = false;
    EXPECT_THROW(ControlLoop(*rig.manager, rig.gate, Time{}, options, rig.log), std::system_error);
  }
}

TEST(LoopGateTest, TimeoutDoesNotDependOnWallClock) {
  LoopGate gate;
  gate.lock();
  const WallClockAhead set_back(3600);
  auto other = std::async(std::launch::async, [&] { return gate.try_lock_for(milliseconds(5)); });
  EXPECT_EQ(other.wait_for(std::chrono::seconds(20)), std::future_status::ready)
      << "the thread still waits for a gate that it was to try for 5 ms";
  gate.unlock();
  EXPECT_FALSE(other.get());
}

TEST(AsyncHardwareTest, SlowDeviceDoesNotDelayLoop) {
  HardwareDescription slow = loopback({{"fault", "late"}, {"fault_size", "0.02"}});
  slow.is_async = true;
  slow.rw_rate = 40;
  LoopRig rig(slow);
  Node speaker(rig.bus, "/speaker");
  const auto commands = speaker.advertise<std_msgs::msg::Float64MultiArray>("/g/commands");
  rig.look([&] { commands.publish({{}, {1.0}}, Time{}); });
  EXPECT_TRUE(rig.attend_until(
      [&] { return rig.manager->state("a/position") > 0.1 && rig.loop->statistics().execution > 0; }));
  EXPECT_LT(rig.look([&] { return rig.loop->statistics().execution; }), 0.01);  // on average: half of a read
}

TEST(AsyncHardwareTest, DeviceErrorBecomesComponentError) {
  HardwareDescription failing = loopback({{"fault", "throw"}, {"fault_at", "5"}});
  failing.is_async = true;
  LoopRig rig(failing);
  EXPECT_TRUE(rig.attend_until([&] { return !rig.manager->hardware().front().fault.empty(); }));
  const HardwareView view = rig.look([&] { return rig.manager->hardware().front(); });
  EXPECT_EQ(view.state, HardwareState::unconfigured);
  EXPECT_THAT(view.fault, HasSubstr("its <param> 'fault' triggers it"));
}

}  // namespace
}  // namespace doppel
