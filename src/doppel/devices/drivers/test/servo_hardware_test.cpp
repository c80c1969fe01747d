// The driver against emulated servos: how motion begins, how it is bounded, and what is left of it when
// something fails.
#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <utility>

#include "doppel/devices/drivers/detail/servo_group.h"
#include "doppel/devices/drivers/test/driver_bench.h"

namespace doppel {
namespace {

using test::DriverBench;
using test::SentRequest;
using testing::AllOf;
using testing::HasSubstr;

class EveryDriver : public testing::TestWithParam<const char*> {};

TEST_P(EveryDriver, CommandMovesJointsThere) {
  DriverBench bench(GetParam());
  bench.start();
  bench.commands = {0.5, -0.5, 1.0};
  ASSERT_EQ(bench.run(1.5), HardwareReturn::ok);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(bench.q(i), bench.commands[i], 0.003);
  EXPECT_NEAR(bench.states[0], 0.5, 0.003);
  EXPECT_EQ(bench.driver->state(), DriverState::active);
}

TEST_P(EveryDriver, ActivationDoesNotMoveJoints) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> pose(-1.9, 1.9);
    DriverBench bench(GetParam());
    std::vector<double> before;
    for (MotorState& one : bench.machine.states) before.push_back(one.position = pose(random));
    // Goals of another program are still in the servos.
    for (RegisterServo& one : bench.devices.servos())
      one.set(ServoRole::goal_position, static_cast<std::int64_t>(random() % 4096));
    for (int i = 0; i < 10; ++i) bench.machine.step();
    bench.start();
    for (int i = 0; i < 200; ++i) {
      ASSERT_EQ(bench.cycle(), HardwareReturn::ok);
      for (std::size_t joint = 0; joint < 3; ++joint) ASSERT_NEAR(bench.q(joint), before[joint], 0.01);
    }
  }
}

TEST_P(EveryDriver, FirstCommandFarAwayIsReachedAtSpeedLimit) {
  DriverBench bench(GetParam());
  bench.start();
  bench.run(0.1);
  bench.commands = {1.9, 1.9, 1.9};
  double before = bench.q(0), fastest = 0;
  for (int i = 0; i < 60; ++i) {
    bench.cycle();
    fastest = std::max(fastest, (bench.q(0) - before) / 0.01);
    before = bench.q(0);
  }
  EXPECT_LE(fastest, 1.2 * 4 + 0.16) << "a tick in 10 ms is 0.15 rad/s";
  bench.driver->attend();
  EXPECT_THAT(bench.logged, HasSubstr("is commanded faster than its speed limit"));
}

TEST_P(EveryDriver, StopHoldsWithinTwoCycles) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    DriverBench bench(GetParam());
    bench.start();
    bench.commands = {1.8, -1.8, 1.8};
    bench.run(0.05 + 0.3 * std::uniform_real_distribution<double>()(random));
    const double before = bench.q(0);
    bench.driver->on_stop();
    bench.run(1.0, false);
    EXPECT_NEAR(bench.q(0), before, 0.05);
    const double held = bench.q(0);
    bench.driver->on_stop_reset();
    bench.commands.assign(3, std::nan(""));
    bench.run(0.5);
    EXPECT_NEAR(bench.q(0), held, 0.003) << "nothing is resumed";
  }
}

TEST_P(EveryDriver, UnpluggedBusHoldsAndFaultsAndNothingIsResumed) {
  DriverBench bench(GetParam());
  bench.start();
  bench.commands = {1.8, 1.8, 1.8};
  bench.run(0.2);
  const Time begin = bench.machine.now;
  bench.devices.add_fault({.kind = FaultKind::unplug, .begin = begin, .end = begin + from_seconds(1)});
  HardwareReturn answer = HardwareReturn::ok;
  int cycles = 0;
  while (answer == HardwareReturn::ok && cycles < 200) {
    answer = bench.cycle();
    ++cycles;
  }
  EXPECT_EQ(answer, HardwareReturn::error);
  EXPECT_NEAR(cycles * 0.01, 0.5, 0.05);
  EXPECT_THAT(bench.driver->fault(), HasSubstr("the port is gone"));
  EXPECT_EQ(bench.driver->state(), DriverState::fault);
  ASSERT_TRUE(bench.driver->on_error());
  // At most 50 ms of motion after the last goal.
  const double held = bench.q(0);
  for (int i = 0; i < 1000; ++i) bench.machine.step();
  EXPECT_NEAR(bench.q(0), held, 0.01);
  ASSERT_TRUE(bench.driver->on_configure());
  ASSERT_TRUE(bench.driver->on_activate());
  bench.claim();
  bench.commands.assign(3, std::nan(""));
  ASSERT_EQ(bench.run(0.5), HardwareReturn::ok);
  EXPECT_NEAR(bench.q(0), held, 0.01);
}

TEST_P(EveryDriver, FewLostAnswersDoNotDisturbMotion) {
  DriverBench bench(GetParam());
  bench.devices.add_fault({.kind = FaultKind::drop, .share = 0.01});
  bench.start();
  double largest = 0;
  for (int i = 0; i < 3000; ++i) {
    const double command = std::sin(0.02 * i);
    bench.commands = {command, command, command};
    ASSERT_EQ(bench.cycle(), HardwareReturn::ok);
    if (i > 100) largest = std::max(largest, std::abs(bench.q(0) - command));
  }
  EXPECT_LT(largest, 0.05) << "one cycle of motion is 0.02 rad";
}

TEST_P(EveryDriver, SilentServoHoldsAllJointsAndIsNamed) {
  DriverBench bench(GetParam());
  bench.start();
  bench.run(0.2);
  const Time begin = bench.machine.now;
  bench.devices.add_fault(
      {.kind = FaultKind::drop, .servo = 2, .begin = begin, .end = begin + from_seconds(0.3)});
  bench.commands = {1.8, 1.8, 1.8};
  bench.run(0.25);
  EXPECT_EQ(bench.driver->state(), DriverState::degraded);
  EXPECT_LT(bench.q(0), 0.3) << "one servo of three that is missing is a loss of all";
  EXPECT_THAT(bench.logged, HasSubstr("all joints hold"));
  bench.run(0.5);
  EXPECT_EQ(bench.driver->state(), DriverState::active);
  EXPECT_THAT(bench.logged, HasSubstr("all servos answer again"));
}

TEST_P(EveryDriver, ServoThatDoesNotAnswerRefusesConfiguration) {
  DriverBench bench(GetParam());
  bench.devices.servos()[1].set(ServoRole::id, 9);
  ASSERT_TRUE(bench.initialise());
  const Status status = bench.driver->on_configure();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.why(), HasSubstr("'j2' (id 2,"));
  EXPECT_THAT(status.why(), HasSubstr("does not answer"));
  EXPECT_EQ(bench.driver->state(), DriverState::disconnected);
}

TEST_P(EveryDriver, ArmOutsideLimitsIsNotActivated) {
  DriverBench bench(GetParam());
  bench.machine.states[2].position = 2.4;
  for (int i = 0; i < 10; ++i) bench.machine.step();
  ASSERT_TRUE(bench.initialise());
  ASSERT_TRUE(bench.driver->on_configure());
  const Status status = bench.driver->on_activate();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.why(), HasSubstr("'j3' is at 2.4"));
  for (RegisterServo& one : bench.devices.servos()) EXPECT_EQ(one.value(ServoRole::torque_enable), 0);
}

TEST_P(EveryDriver, MovingArmIsNotActivated) {
  DriverBench bench(GetParam());
  ASSERT_TRUE(bench.initialise());
  ASSERT_TRUE(bench.driver->on_configure());
  bench.devices.add_fault({.kind = FaultKind::corrupt, .servo = 1, .begin = bench.machine.now});
  const Status status = bench.driver->on_activate();
  ASSERT_FALSE(status);
  for (RegisterServo& one : bench.devices.servos()) EXPECT_EQ(one.value(ServoRole::torque_enable), 0);
}

TEST_P(EveryDriver, TorqueRampsFromThirtyPercent) {
  DriverBench bench(GetParam());
  bench.start();
  const double whole = static_cast<double>(bench.servo.whole_torque);
  const auto torque = [&] {
    return static_cast<double>(bench.devices.servos()[0].value(ServoRole::torque_limit)) / whole;
  };
  EXPECT_NEAR(torque(), 0.3, 0.01);
  bench.run(0.5);
  EXPECT_NEAR(torque(), 0.65, 0.08);
  bench.run(0.6);
  EXPECT_NEAR(torque(), 1.0, 0.01);
}

TEST_P(EveryDriver, JointThatGivesWayInRampGetsWholeTorque) {
  DriverBench bench(GetParam());
  bench.start();
  bench.run(0.1);
  const std::int64_t whole = bench.servo.whole_torque;
  ASSERT_LT(bench.devices.servos()[1].value(ServoRole::torque_limit), whole / 2);
  bench.machine.drives[1].velocity = 0;  // until the next step: the load pulls it off its goal
  bench.machine.states[1].position += 0.2;
  bench.cycle();
  bench.cycle();
  EXPECT_EQ(bench.devices.servos()[1].value(ServoRole::torque_limit), whole);
}

TEST_P(EveryDriver, TorqueThatIsOnIsNotLowered) {
  DriverBench bench(GetParam());
  const std::int64_t whole = bench.servo.whole_torque;
  for (RegisterServo& one : bench.devices.servos()) {
    one.set(ServoRole::torque_enable, 1);
    one.set(ServoRole::torque_limit, whole);
  }
  bench.start();
  EXPECT_EQ(bench.devices.servos()[0].value(ServoRole::torque_limit), whole);
  bench.run(0.2);
  EXPECT_EQ(bench.devices.servos()[0].value(ServoRole::torque_limit), whole);
}

TEST_P(EveryDriver, DisabledJointStaysWithoutTorqueAndOthersMove) {
  DriverBench bench(GetParam(), DriverBench::gentle_off(),
                    "<param name=\"offset_deg\">0</param><param name=\"enabled\">false</param>");
  bench.start();
  bench.commands = {1, 1, 1};
  bench.run(0.5);
  for (RegisterServo& one : bench.devices.servos()) EXPECT_EQ(one.value(ServoRole::torque_enable), 0);
  EXPECT_NEAR(bench.q(0), 0, 0.003);
}

TEST_P(EveryDriver, AnswerLostAtStartIsAskedForAgain) {
  DriverBench bench(GetParam());
  ASSERT_TRUE(bench.initialise());
  ASSERT_TRUE(bench.driver->on_configure());
  const Time now = bench.link->now();
  bench.devices.add_fault(
      {.kind = FaultKind::drop, .servo = 2, .begin = now, .end = now + from_seconds(0.3)});
  const Status activated = bench.driver->on_activate();
  EXPECT_TRUE(activated) << activated.why();
}

TEST_P(EveryDriver, ReadingLostAtConfigurationIsAskedForAgain) {
  DriverBench bench(GetParam());
  ASSERT_TRUE(bench.initialise());
  bool lost = false;
  bench.loses = [&](const SentRequest& request) {
    return request.reads_all_servos() && !std::exchange(lost, true);
  };
  const Status configured = bench.driver->on_configure();
  EXPECT_TRUE(configured) << configured.why();
  EXPECT_TRUE(lost) << "expected a reading of all servos";
}

TEST_P(EveryDriver, ServoWithUnansweredRegisterIsRefused) {
  using enum ServoRole;
  for (const ServoRole role : {operating_mode, homing_offset, present_voltage, errors}) {
    DriverBench bench(GetParam());
    ASSERT_TRUE(bench.initialise());
    ServoSetup setup = bench.driver->setup();
    setup.joints[1].recorded = RecordedCalibration{};
    const ServoRegister& silent = *bench.servo.find(role);
    bench.loses = [&](const SentRequest& request) { return request.id == 2 && request.reads(silent); };
    test::LossyLink link(bench.loses, bench.devices, "lossy", setup.rate);
    link.follow(bench.machine.now);
    const Status connected = make_register_group(setup, link)->connect();
    EXPECT_THAT(connected.why(), AllOf(HasSubstr("'j2' (id 2"), HasSubstr(std::string(silent.name))));
  }
}

TEST_P(EveryDriver, LateAnswerDoesNotHideThatArmIsHeld) {
  for (const bool held : {false, true}) {
    DriverBench bench(GetParam());
    const std::int64_t whole = bench.servo.whole_torque;
    for (RegisterServo& one : bench.devices.servos()) {
      one.set(ServoRole::torque_enable, held ? 1 : 0);
      one.set(ServoRole::torque_limit, whole);
    }
    const ServoRegister& torque = *bench.servo.find(ServoRole::torque_enable);
    bench.loses = [&](const SentRequest& request) {
      const Time now = bench.link->now();
      if (request.reads(torque))
        bench.devices.add_fault(
            {.kind = FaultKind::late, .begin = now, .end = now + from_seconds(0.001), .amount = 0.02});
      return false;
    };
    bench.start();
    const double share = static_cast<double>(bench.devices.servos()[0].value(ServoRole::torque_limit)) /
                         static_cast<double>(whole);
    EXPECT_NEAR(share, held ? 1.0 : 0.3, 0.01);
  }
}

TEST_P(EveryDriver, ArmThatDoesNotSayWhetherItIsHeldKeepsItsTorque) {
  DriverBench bench(GetParam());
  const std::int64_t whole = bench.servo.whole_torque;
  for (RegisterServo& one : bench.devices.servos()) {
    one.set(ServoRole::torque_enable, 1);
    one.set(ServoRole::torque_limit, whole);
  }
  const ServoRegister& torque = *bench.servo.find(ServoRole::torque_enable);
  bench.loses = [&](const SentRequest& request) { return request.reads(torque); };
  bench.start();
  for (RegisterServo& one : bench.devices.servos()) EXPECT_EQ(one.value(ServoRole::torque_limit), whole);
}

TEST_P(EveryDriver, ServoThatStaysSilentAtStartIsRefused) {
  DriverBench bench(GetParam());
  ASSERT_TRUE(bench.initialise());
  ASSERT_TRUE(bench.driver->on_configure());
  bench.devices.add_fault({.kind = FaultKind::drop, .servo = 2});
  const Time begin = bench.link->now();
  EXPECT_THAT(bench.driver->on_activate().why(), HasSubstr("does not answer; no torque was turned on"));
  EXPECT_LT(to_seconds(bench.link->now() - begin), 1.5);
  for (RegisterServo& one : bench.devices.servos()) EXPECT_EQ(one.value(ServoRole::torque_enable), 0);
}

TEST_P(EveryDriver, GentleArmIsReportedAsGentle) {
  for (const char* gentle : {"always", "never"}) {
    DriverBench bench(GetParam(), std::string("<param name=\"gentle\">") + gentle +
                                      "</param><param name=\"rate\">1000000</param>");
    bench.start();
    bench.commands = {0.1, 0.1, 0.1};
    bench.run(0.2);
    DeviceReport report;
    ASSERT_TRUE(bench.driver->report(report));
    EXPECT_EQ(report.state, std::string(gentle) == "always" ? "gentle" : "active");
  }
}

TEST_P(EveryDriver, DeactivationHoldsOrRelaxes) {
  for (const bool relax : {false, true}) {
    DriverBench bench(GetParam(), DriverBench::gentle_off() + "<param name=\"on_deactivate\">" +
                                      (relax ? "relax" : "hold") + "</param>");
    bench.start();
    bench.commands = {1, 1, 1};
    bench.run(0.2);
    const double before = bench.q(0);
    ASSERT_TRUE(bench.driver->on_deactivate());
    bench.run(0.5, false);
    EXPECT_NEAR(bench.q(0), before, 0.05);
    EXPECT_EQ(bench.devices.servos()[0].value(ServoRole::torque_enable), relax ? 0 : 1);
  }
}

TEST_P(EveryDriver, HotServoWithoutParkPoseFaultsInPlace) {
  DriverBench bench(GetParam());
  bench.start();
  bench.run(0.3);
  bench.devices.add_fault({.kind = FaultKind::hot, .servo = 2, .begin = bench.machine.now, .amount = 71});
  bench.commands = {1, 1, 1};
  EXPECT_EQ(bench.run(1.0), HardwareReturn::error);
  EXPECT_THAT(bench.driver->fault(), HasSubstr("70 degrees"));
}

TEST_P(EveryDriver, GentleDriverMovesAtQuarterOfSpeed) {
  DriverBench bench(GetParam(), "<param name=\"rate\">1000000</param>");
  bench.start();
  bench.commands = {1.9, 1.9, 1.9};
  bench.run(1.0);
  EXPECT_NEAR(bench.q(0), 1.0, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Protocols, EveryDriver, testing::Values("doppel/FeetechSts", "doppel/DynamixelX"),
                         [](const auto& one) { return std::string(one.param).substr(7); });

TEST(ServoHardware, WrongParametersAreReportedWithNearestNames) {
  DriverBench bench("doppel/FeetechSts", "<param name=\"prot\">x</param><param name=\"torque\">7</param>",
                    "<param name=\"direction\">2</param>");
  try {
    static_cast<void>(bench.initialise());
    FAIL();
  } catch (const InputError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("did you mean 'port'?"));
    EXPECT_THAT(problem.what(), HasSubstr("'torque' is '7', but must be a number from 0.05 to 1"));
    EXPECT_THAT(problem.what(), HasSubstr("joint 'j3': <param> 'direction'"));
  }
}

TEST(ServoHardware, ForeignPluginsKeepTheirParameters) {
  DriverBench bench("feetech_ros2_driver/FeetechHardwareInterface",
                    "<param name=\"usb_port\">/dev/ttyACM0</param>",
                    "<param name=\"offset\">1024</param><param name=\"p_cofficient\">16</param>");
  ASSERT_TRUE(bench.initialise());
  EXPECT_EQ(bench.driver->setup().port, "/dev/ttyACM0");
  EXPECT_NEAR(bench.driver->setup().joints[0].offset, -M_PI / 2, 1e-9);
}

TEST(ServoHardware, WrongModelAndSupplyAreNamed) {
  DriverBench bench;
  bench.devices.servos()[0].set("Model_Number", 9);
  bench.devices.servos()[1].set_supply(12);
  bench.machine.step();
  ASSERT_TRUE(bench.initialise());
  const Status status = bench.driver->on_configure();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.why(), HasSubstr("'j1' (id 1, STS3215) is another model: number 9"));
  EXPECT_THAT(status.why(), HasSubstr("'j2' (id 2, STS3215) has a supply of 12.0 V"));
}

// It confirms the write of its torque, and stays without it.
TEST(ServoHardware, ServoThatRefusesItsTorqueRefusesActivation) {
  DriverBench bench("doppel/DynamixelX");
  ASSERT_TRUE(bench.initialise());
  ASSERT_TRUE(bench.driver->on_configure());
  bench.devices.add_fault({.kind = FaultKind::overload, .servo = 2, .begin = bench.machine.now});
  for (int i = 0; i < 10; ++i) bench.machine.step();
  EXPECT_THAT(bench.driver->on_activate().why(), HasSubstr("'j2' (id 2, XL430-W250) does not confirm"));
  for (RegisterServo& one : bench.devices.servos()) EXPECT_EQ(one.value(ServoRole::torque_enable), 0);
}

TEST(ServoHardware, DirectionScaleAndOffsetMapJointsToShafts) {
  DriverBench bench("doppel/FeetechSts", DriverBench::gentle_off(),
                    "<param name=\"offset_deg\">30</param><param name=\"direction\">-1</param><param "
                    "name=\"scale\">0.5</param>");
  for (MotorState& one : bench.machine.states) one.position = M_PI / 6;
  for (int i = 0; i < 10; ++i) bench.machine.step();
  bench.start();
  bench.commands = {1, 1, 1};
  bench.run(1.5);
  EXPECT_NEAR(bench.q(0), M_PI / 6 - 0.5, 0.003);
  EXPECT_NEAR(bench.states[0], 1, 0.006);
}

}  // namespace
}  // namespace doppel
