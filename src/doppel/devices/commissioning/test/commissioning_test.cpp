// Scan, check and nudge against emulated servos with what goes wrong on a bench: shared ids, other rates,
// other supplies, swapped plugs, wrong directions.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <numbers>

#include "doppel/devices/commissioning/bus_check.h"
#include "doppel/devices/commissioning/bus_scan.h"
#include "doppel/devices/commissioning/nudge.h"
#include "doppel/devices/commissioning/recovery.h"
#include "doppel/devices/drivers/test/driver_bench.h"
#include "doppel/devices/emulation/test/endless_link.h"

namespace doppel {
namespace {

using test::DriverBench;
using test::SentRequest;
using testing::HasSubstr;

constexpr double kThreeDegrees = 3 * std::numbers::pi / 180;

// A bench whose motors move while its link waits.
struct Commissioned : DriverBench {
  explicit Commissioned(const std::string& plugin = "doppel/FeetechSts",
                        const std::string& joint_params = "<param name=\"offset_deg\">0</param>")
      : DriverBench(plugin, DriverBench::gentle_off(), joint_params),
        wire(loses, devices, "emulated", 1000000),
        bus(wire, servo.protocol, 1000000) {
    static_cast<void>(initialise());
    wire.set_world([this](Time when) {
      while (machine.now < when) machine.step();
    });
    wire.follow(machine.now);
  }
  [[nodiscard]] const ServoSetup& setup() const { return driver->setup(); }
  test::LossyLink wire;
  ServoBus bus;
};

TEST(BusScan, ServosAreFoundAtTheirProtocolAndRate) {
  for (const char* const plugin : {"doppel/FeetechSts", "doppel/DynamixelX"}) {
    Commissioned bench(plugin);
    for (RegisterServo& one : bench.devices.servos()) one.set(ServoRole::baud_rate, 2);
    const int rate = bench.devices.servos().front().rate();
    const auto found = scan_link(bench.wire, {});
    ASSERT_EQ(found.size(), 3U) << plugin;
    EXPECT_EQ(found[0].protocol, bench.servo.protocol);
    EXPECT_EQ(found[0].rate, rate);
    EXPECT_EQ(found[2].answer.id, 3);
    EXPECT_EQ(found[2].model, &bench.servo);
    EXPECT_NEAR(found[2].reading.voltage, bench.servo.rated_voltage, 0.3);
  }
}

TEST(BusScan, SharedIdIsFound) {
  Commissioned bench;
  bench.devices.servos()[2].set(ServoRole::id, 2);
  bench.machine.states[2].position = 0.45;
  const auto found = scan_link(bench.wire, {.protocols = {ServoProtocol::feetech}});
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].answer.answers, 1U);
  EXPECT_EQ(found[1].answer.answers, 2U);
}

TEST(BusScan, SilentLinkFindsNothingAndReportsProgress) {
  Commissioned bench;
  bench.devices.add_fault({.kind = FaultKind::drop});
  std::vector<std::string> tried;
  const auto found = scan_link(
      bench.wire, {.rates = {1000000}, .last_id = 5, .progress = [&](double, const std::string& what) {
                     tried.push_back(what);
                     return true;
                   }});
  EXPECT_TRUE(found.empty());
  EXPECT_THAT(tried, testing::ElementsAre("feetech at 1000000 bit/s", "dynamixel at 1000000 bit/s",
                                          "servo_line at 1000000 bit/s"));
}

// A receiver of GPS, for instance: a link has bytes of it after each deadline, too.
TEST(BusScan, DeviceThatSendsWithoutEndIsNotFound) {
  Commissioned bench;
  const std::string text = "$GPGGA,123519,4807.038,N,01131.000,E\r\n";
  test::EndlessLink link(bench.devices, "receiver", 1000000);
  link.follow(bench.machine.now);
  link.begin(std::vector<std::uint8_t>(text.begin(), text.end()));
  const Time begin = link.now();
  EXPECT_TRUE(scan_link(link, {.rates = {1000000}, .last_id = 5}).empty());
  EXPECT_LT(to_seconds(link.now() - begin), 2);
}

TEST(BusCheck, FactoryServosNeedChangesAndPassAfterThem) {
  for (const char* const plugin : {"doppel/FeetechSts", "doppel/DynamixelX"}) {
    Commissioned bench(plugin);
    for (RegisterServo& one : bench.devices.servos()) one.set(ServoRole::return_delay, 250);
    const BusCheck before = check_bus(bench.bus, bench.setup());
    EXPECT_FALSE(before.passed());
    ASSERT_EQ(before.changes.size(), 9U) << "return delay and two limits of three servos";
    const auto backup =
        std::filesystem::temp_directory_path() / ("registers_" + std::to_string(::getpid()) + ".yaml");
    apply_changes(bench.bus, bench.setup(), before.changes, backup);
    EXPECT_TRUE(check_bus(bench.bus, bench.setup()).passed());
    EXPECT_EQ(bench.devices.servos()[0].value(ServoRole::min_position), 744);
    const auto back = changes_back(bench.bus, bench.setup(), backup);
    EXPECT_EQ(back.size(), 9U);
    apply_changes(bench.bus, bench.setup(), back, backup);
    EXPECT_EQ(bench.devices.servos()[0].value(ServoRole::return_delay), 250);
    EXPECT_EQ(bench.devices.servos()[0].value(ServoRole::min_position), 0);
    std::filesystem::remove(backup);
  }
}

TEST(BusCheck, NothingIsWrittenWhileTorqueIsOn) {
  Commissioned bench;
  bench.devices.servos()[1].set(ServoRole::return_delay, 250);
  const BusCheck check = check_bus(bench.bus, bench.setup());
  bench.devices.servos()[1].set(ServoRole::torque_enable, 1);
  try {
    apply_changes(bench.bus, bench.setup(), check.changes, "/tmp/never.yaml");
    FAIL();
  } catch (const InputError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("while its torque is on"));
  }
  EXPECT_EQ(bench.devices.servos()[1].value(ServoRole::return_delay), 250);
  EXPECT_FALSE(std::filesystem::exists("/tmp/never.yaml"));
}

TEST(BusCheck, SupplyFaultAndMissingServoAreNamed) {
  Commissioned bench;
  for (RegisterServo& one : bench.devices.servos()) one.set_supply(12);
  bench.devices.servos()[2].set(ServoRole::id, 8);
  bench.machine.step();
  const BusCheck check = check_bus(bench.bus, bench.setup());
  std::string text;
  for (const Diagnostic& one : check.findings) text += one.message + "\n";
  EXPECT_THAT(text, HasSubstr("'j1' (id 1): has a supply of 12.0 V, and is made for 4.0 to 8.4 V"));
  EXPECT_THAT(text, HasSubstr("'j3' (id 3): does not answer"));
}

TEST(BusCheck, ServoThatFallsSilentDuringCheckDoesNotPass) {
  Commissioned bench;
  const auto backup =
      std::filesystem::temp_directory_path() / ("registers_" + std::to_string(::getpid()) + ".yaml");
  apply_changes(bench.bus, bench.setup(), check_bus(bench.bus, bench.setup()).changes, backup);
  std::filesystem::remove(backup);
  const Time begin = bench.wire.now();
  ASSERT_TRUE(check_bus(bench.bus, bench.setup()).passed());
  const Duration whole = bench.wire.now() - begin;
  for (int tenth = 0; tenth < 10; ++tenth) {
    bench.devices.set_faults({});
    // After this time the bus expects no missing answer any more.
    bench.wire.wait_until(bench.wire.now() + from_seconds(1));
    ASSERT_TRUE(check_bus(bench.bus, bench.setup()).passed());
    bench.devices.add_fault({.kind = FaultKind::drop, .begin = bench.wire.now() + whole * tenth / 10});
    EXPECT_FALSE(check_bus(bench.bus, bench.setup()).passed()) << "silent from " << tenth << " tenths on";
  }
}

TEST(BusCheck, SilentServoIsNotTakenForRestored) {
  Commissioned bench;
  const auto backup =
      std::filesystem::temp_directory_path() / ("registers_" + std::to_string(::getpid()) + ".yaml");
  apply_changes(bench.bus, bench.setup(), check_bus(bench.bus, bench.setup()).changes, backup);
  bench.devices.add_fault({.kind = FaultKind::drop, .servo = 2, .begin = bench.wire.now()});
  try {
    static_cast<void>(changes_back(bench.bus, bench.setup(), backup));
    ADD_FAILURE() << "expected that the silent servo is an error";
  } catch (const InputError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("'j2' (id 2) does not answer"));
  }
  std::filesystem::remove(backup);
}

TEST(BusCheck, LimitsBeyondTurnAreError) {
  Commissioned bench("doppel/FeetechSts", "<param name=\"offset_deg\">90</param>");
  const BusCheck check = check_bus(bench.bus, bench.setup());
  ASSERT_FALSE(check.findings.empty());
  EXPECT_THAT(check.findings.front().message, HasSubstr("and the servo has 0 to 4095"));
}

TEST(Nudge, RightJointFollowsAndComesBack) {
  for (const char* const plugin : {"doppel/FeetechSts", "doppel/DynamixelX"}) {
    Commissioned bench(plugin);
    const NudgeResult result = nudge(bench.bus, bench.setup(), "j2", {});
    EXPECT_TRUE(result.followed(kThreeDegrees)) << result.moved;
    EXPECT_NEAR(result.returned, 0, 0.003);
    EXPECT_TRUE(result.others.empty());
    EXPECT_EQ(bench.devices.servos()[1].value(ServoRole::torque_enable), 0) << "as it was before";
    EXPECT_EQ(bench.devices.servos()[1].value(ServoRole::torque_limit), bench.servo.whole_torque);
  }
}

TEST(Nudge, BlockedJointDoesNotFollow) {
  Commissioned bench;
  bench.devices.add_fault({.kind = FaultKind::stuck, .servo = 2});
  EXPECT_FALSE(nudge(bench.bus, bench.setup(), "j2", {}).followed(kThreeDegrees));
}

TEST(Nudge, UnknownJointAndSilentServoAreErrors) {
  Commissioned bench;
  EXPECT_THROW(static_cast<void>(nudge(bench.bus, bench.setup(), "j7", {})), InputError);
  bench.devices.servos()[1].set(ServoRole::id, 9);
  try {
    static_cast<void>(nudge(bench.bus, bench.setup(), "j2", {}));
    FAIL();
  } catch (const InputError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("'j2' (id 2) does not answer"));
  }
}

// It may have moved as well, before the motion or during it.
TEST(Nudge, OtherServoThatIsSilentIsNamed) {
  for (const double begin : {0.0, 0.5}) {
    Commissioned bench;
    bench.devices.add_fault(
        {.kind = FaultKind::drop, .servo = 3, .begin = bench.wire.now() + from_seconds(begin)});
    try {
      static_cast<void>(nudge(bench.bus, bench.setup(), "j2", {}));
      ADD_FAILURE() << "expected that a servo silent from " << begin << " s on is an error";
    } catch (const InputError& problem) {
      EXPECT_THAT(problem.what(), HasSubstr("'j3' (id 3) does not answer"));
    }
    EXPECT_NEAR(bench.q(1), 0, 0.003);
    EXPECT_EQ(bench.devices.servos()[1].value(ServoRole::torque_enable), 0);
  }
}

TEST(Nudge, UnconfirmedLimitLeavesNoTorqueOn) {
  for (const char* const plugin : {"doppel/FeetechSts", "doppel/DynamixelX"}) {
    Commissioned bench(plugin);
    const ServoRegister& limit = *bench.servo.find(ServoRole::torque_limit);
    int written = 0;
    bench.loses = [&](const SentRequest& request) { return request.writes(limit) && ++written > 1; };
    EXPECT_THROW(static_cast<void>(nudge(bench.bus, bench.setup(), "j2", {})), InputError);
    EXPECT_GT(written, 1) << "expected that the limit is written back";
    EXPECT_EQ(bench.devices.servos()[1].value(ServoRole::torque_enable), 0);
  }
}

TEST(Nudge, UnconfirmedTorqueIsSwitchedOffAgain) {
  for (const char* const plugin : {"doppel/FeetechSts", "doppel/DynamixelX"}) {
    Commissioned bench(plugin);
    const ServoRegister& torque = *bench.servo.find(ServoRole::torque_enable);
    // The write reaches the servo, and its answer is lost.
    bench.loses = [&](const SentRequest& request) {
      const Time now = bench.wire.now();
      if (request.writes(torque) && request.value != 0)
        bench.devices.add_fault(
            {.kind = FaultKind::drop, .servo = 2, .begin = now, .end = now + from_seconds(0.001)});
      return false;
    };
    EXPECT_THROW(static_cast<void>(nudge(bench.bus, bench.setup(), "j2", {})), InputError);
    EXPECT_EQ(bench.devices.servos()[1].value(ServoRole::torque_enable), 0);
  }
}

TEST(Nudge, ServoThatFallsSilentOnItsWayHasItsTorqueOff) {
  Commissioned bench;
  int calls = 0;
  const auto falls_silent = [&] {
    if (++calls == 10) bench.devices.add_fault({.kind = FaultKind::drop, .servo = 2});
    return false;
  };
  EXPECT_THROW(static_cast<void>(nudge(bench.bus, bench.setup(), "j2", {.ends = falls_silent})), InputError);
  EXPECT_EQ(bench.devices.servos()[1].value(ServoRole::torque_enable), 0);
}

TEST(Nudge, PersonEndsMotion) {
  Commissioned bench;
  int calls = 0;
  const NudgeResult result = nudge(bench.bus, bench.setup(), "j2", {.ends = [&] { return ++calls == 10; }});
  EXPECT_TRUE(result.ended);
  EXPECT_LT(result.moved, kThreeDegrees);
}

TEST(Recovery, JointOutsideLimitsIsDrivenInsideSlowly) {
  for (const char* plugin : {"doppel/FeetechSts", "doppel/DynamixelX"}) {
    Commissioned bench(plugin);
    bench.machine.states[1].position = 2.3;
    for (int i = 0; i < 10; ++i) bench.machine.step();
    bench.wire.follow(bench.machine.now);
    const Recovery plan = plan_recovery(bench.bus, bench.setup(), "j2");
    EXPECT_FALSE(plan.is_inside);
    EXPECT_NEAR(plan.start, 2.3, 0.003);
    EXPECT_EQ(bench.devices.servos()[1].value(ServoRole::torque_enable), 0) << "a plan moves nothing";
    double fastest = 0;
    double before = bench.q(1);
    Time then = bench.machine.now;
    const Recovery out = recover(bench.bus, bench.setup(), "j2", {.ends = [&] {
                                   const double dt = to_seconds(bench.machine.now - then);
                                   if (dt > 0)
                                     fastest = std::max(fastest, std::abs(bench.q(1) - before) / dt);
                                   before = bench.q(1);
                                   then = bench.machine.now;
                                   return false;
                                 }});
    EXPECT_TRUE(out.is_inside) << out.end;
    EXPECT_LE(bench.q(1), 2.0) << plugin;
    EXPECT_LE(fastest, 6 * std::numbers::pi / 180 + 0.02) << "5 deg/s, and a tick";
    EXPECT_EQ(bench.devices.servos()[1].value(ServoRole::torque_limit),
              std::llround(0.3 * static_cast<double>(bench.servo.whole_torque)));
  }
}

TEST(Recovery, JointInsideLimitsStaysAsItIs) {
  Commissioned bench;
  const Recovery out = recover(bench.bus, bench.setup(), "j2", {});
  EXPECT_TRUE(out.is_inside);
  EXPECT_EQ(out.start, out.end);
  EXPECT_EQ(bench.devices.servos()[1].value(ServoRole::torque_enable), 0);
}

}  // namespace
}  // namespace doppel
