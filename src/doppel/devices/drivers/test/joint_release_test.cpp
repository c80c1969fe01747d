// The short release of one joint's torque on emulated buses: when it is refused, what ends it, and that the
// joint is caught and taken along again without a jump.
#include <gmock/gmock.h>

#include <cmath>

#include "doppel/devices/drivers/detail/release_watch.h"
#include "doppel/devices/drivers/test/driver_bench.h"

namespace doppel {
namespace {

using test::DriverBench;
using testing::HasSubstr;

constexpr double kCyclePeriod = 0.01;                    // s
constexpr double kRegisterTick = 2 * 3.14159265 / 4096;  // rad

// An arm that holds, with "j2" at 1 rad, and falls by hand: the bench's motors have no load.
class FallingArm {
 public:
  explicit FallingArm(const char* plugin, const std::string& params = DriverBench::gentle_off())
      : bench(plugin, params) {
    bench.start();
    bench.commands = {0.0, 1.0, 0.0};
    EXPECT_EQ(bench.run(2.5), HardwareReturn::ok);
  }
  Status release(double duration = 1.0, double lower = 0.2, double upper = 1.2, double speed = 3.0) {
    return bench.driver->release_joint({"j2", duration, lower, upper, speed});
  }
  [[nodiscard]] bool torque(std::size_t joint = 1) {
    return bench.devices.servos()[joint].value(ServoRole::torque_enable) != 0;
  }
  [[nodiscard]] double servo_goal(std::size_t joint = 1) {
    return bench.servo.angle(bench.devices.servos()[joint].value(ServoRole::goal_position));
  }
  // A cycle; a joint without torque moves at this speed (rad/s).
  HardwareReturn fall(double speed) {
    if (!torque()) bench.machine.states[1].position += speed * kCyclePeriod;
    return bench.cycle();
  }
  // Cycles until the torque is on again; -1: it stays off.
  int cycles_until_caught(double speed, int most = 300) {
    for (int i = 1; i <= most; ++i) {
      if (fall(speed) != HardwareReturn::ok) return -1;
      if (torque()) return i;
    }
    return -1;
  }
  // The servo stays where it was caught, although the controller still commands where it was lifted to.
  void expect_held() {
    const double caught = bench.q(1);
    EXPECT_NEAR(servo_goal(), caught, 0.04);
    for (int i = 0; i < 50; ++i) {
      ASSERT_EQ(bench.cycle(), HardwareReturn::ok);
      ASSERT_NEAR(bench.q(1), caught, 0.04) << "it does not jump back";
    }
    for (const std::size_t other : {0U, 2U}) {
      EXPECT_TRUE(torque(other));
      EXPECT_NEAR(bench.q(other), 0, 0.005);
    }
  }
  DeviceReport::Joint report() {
    DeviceReport out;
    EXPECT_TRUE(bench.driver->report(out));
    return out.joints.at(1);
  }

  DriverBench bench;
};

class JointReleaseOf : public testing::TestWithParam<const char*> {};

TEST_P(JointReleaseOf, TorqueIsOffForItsTimeAndOthersHold) {
  FallingArm arm(GetParam());
  const Status released = arm.release(0.5);
  ASSERT_TRUE(released) << released.why();
  EXPECT_FALSE(arm.torque());
  EXPECT_TRUE(arm.torque(0));
  const int cycles = arm.cycles_until_caught(-0.5);
  EXPECT_NEAR(cycles * kCyclePeriod, 0.5, 0.02);
  EXPECT_NEAR(arm.bench.q(1), 0.75, 0.02);
  arm.expect_held();
  arm.bench.driver->attend();
  EXPECT_THAT(arm.bench.logged, HasSubstr("'j2' is held again, because its time was over"));
}

TEST_P(JointReleaseOf, ReportHasTimesOfTorque) {
  FallingArm arm(GetParam());
  EXPECT_EQ(arm.report().torque_off, Time{});
  const Time begin = arm.bench.machine.now;
  ASSERT_TRUE(arm.release(0.3));
  static_cast<void>(arm.fall(0));
  EXPECT_TRUE(arm.report().released);
  EXPECT_EQ(arm.report().torque_on, Time{});
  EXPECT_GT(arm.cycles_until_caught(0), 0);
  EXPECT_FALSE(arm.report().released);
  EXPECT_NEAR(to_seconds(arm.report().torque_off - begin), 0, 0.01);
  EXPECT_NEAR(to_seconds(arm.report().torque_on - arm.report().torque_off), 0.3, 0.02);
  EXPECT_NEAR(arm.report().goal, arm.bench.q(1), kRegisterTick);
}

TEST_P(JointReleaseOf, IntervalAndSpeedEndIt) {
  FallingArm leaves(GetParam());
  ASSERT_TRUE(leaves.release(2.0, 0.6, 1.2));
  EXPECT_GT(leaves.cycles_until_caught(-1.0), 0);
  EXPECT_NEAR(leaves.bench.q(1), 0.6, 0.03);
  leaves.expect_held();
  FallingArm fast(GetParam());
  ASSERT_TRUE(fast.release(2.0, -1.0, 1.2, 1.5));
  EXPECT_LE(fast.cycles_until_caught(-2.5), 3);
  fast.expect_held();
}

TEST_P(JointReleaseOf, FollowsAgainFromWhereItWasCaught) {
  FallingArm arm(GetParam());
  ASSERT_TRUE(arm.release(0.4));
  ASSERT_GT(arm.cycles_until_caught(-0.5), 0);
  arm.expect_held();
  // A controller that begins there, and goes back up.
  double before = arm.bench.q(1), fastest = 0;
  for (double command = before; command < 1.0; command += 0.01) {
    arm.bench.commands[1] = command;
    ASSERT_EQ(arm.bench.cycle(), HardwareReturn::ok);
    fastest = std::max(fastest, std::abs(arm.bench.q(1) - before) / kCyclePeriod);
    before = arm.bench.q(1);
  }
  ASSERT_EQ(arm.bench.run(0.5), HardwareReturn::ok);
  EXPECT_NEAR(arm.bench.q(1), 1.0, 0.02);
  EXPECT_LT(fastest, 1.2 * 4 + 0.16);
}

TEST_P(JointReleaseOf, StopCatchesAtOnce) {
  FallingArm arm(GetParam());
  ASSERT_TRUE(arm.release(2.0));
  for (int i = 0; i < 10; ++i) static_cast<void>(arm.fall(-1.0));
  arm.bench.driver->on_stop();
  EXPECT_TRUE(arm.torque());
  const double caught = arm.bench.q(1);
  for (int i = 0; i < 50; ++i) static_cast<void>(arm.fall(-1.0));
  EXPECT_NEAR(arm.bench.q(1), caught, 0.04);
  arm.bench.driver->on_stop_reset();
  arm.expect_held();
}

TEST_P(JointReleaseOf, DeactivationAndErrorCatch) {
  FallingArm arm(GetParam());
  ASSERT_TRUE(arm.release(2.0));
  static_cast<void>(arm.fall(-1.0));
  ASSERT_TRUE(arm.bench.driver->on_deactivate());
  EXPECT_TRUE(arm.torque());
  EXPECT_NEAR(arm.servo_goal(), arm.bench.q(1), 0.04);
  FallingArm fails(GetParam());
  ASSERT_TRUE(fails.release(2.0));
  static_cast<void>(fails.fall(-1.0));
  ASSERT_TRUE(fails.bench.driver->on_error());
  EXPECT_TRUE(fails.torque());
}

TEST_P(JointReleaseOf, RelaxedArmIsNotCaughtLater) {
  FallingArm arm(GetParam());
  ASSERT_TRUE(arm.release(0.3));
  static_cast<void>(arm.fall(-0.5));
  ASSERT_TRUE(arm.bench.driver->relax());
  for (int i = 0; i < 60; ++i) {
    static_cast<void>(arm.fall(0));
    for (const std::size_t joint : {0U, 1U, 2U}) ASSERT_FALSE(arm.torque(joint)) << "cycle " << i;
  }
}

TEST_P(JointReleaseOf, AnotherJointThatMovesEndsIt) {
  FallingArm arm(GetParam());
  ASSERT_TRUE(arm.release(2.0, -1.9, 1.9));
  for (int i = 0; i < 20; ++i) static_cast<void>(arm.fall(-0.2));
  ASSERT_FALSE(arm.torque());
  arm.bench.commands[0] = 0.5;
  const int cycles = arm.cycles_until_caught(-0.2);
  EXPECT_GT(cycles, 0);
  EXPECT_LE(cycles, 5);
}

TEST_P(JointReleaseOf, MissingAnswersEndIt) {
  FallingArm arm(GetParam());
  ASSERT_TRUE(arm.release(2.0, -1.9, 1.9));
  static_cast<void>(arm.fall(-1.0));
  EmulatedFault drop{.kind = FaultKind::drop, .share = 1};
  drop.begin = arm.bench.machine.now;
  drop.end = drop.begin + from_seconds(0.1);
  arm.bench.devices.add_fault(drop);
  const double before = arm.bench.q(1);
  const int cycles = arm.cycles_until_caught(-1.0);
  EXPECT_GT(cycles, 0);
  EXPECT_LE(cycles, 14) << "0.1 s, in which nothing can be confirmed";
  EXPECT_GT(arm.bench.q(1), before - 0.2);
  arm.expect_held();
}

TEST_P(JointReleaseOf, RandomLossesNeverSwitchOnAnotherGoal) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    FallingArm arm(GetParam());
    EmulatedFault loss{.kind = seed % 2 == 0 ? FaultKind::drop : FaultKind::corrupt, .share = 0.3};
    loss.begin = arm.bench.machine.now + from_seconds(0.01 * static_cast<double>(seed));
    loss.end = loss.begin + from_seconds(0.25);
    if (!arm.release(0.3, 0.3, 1.2)) continue;
    arm.bench.devices.add_fault(loss);
    for (int i = 0; i < 100; ++i) {
      const double before = arm.bench.q(1);
      const HardwareReturn answer = arm.fall(-0.7);
      if (answer != HardwareReturn::ok) break;
      if (arm.torque()) {
        ASSERT_NEAR(arm.bench.q(1), before, 0.06);
      }
      ASSERT_LT(arm.bench.q(1), 1.05);
    }
    EXPECT_TRUE(arm.torque());
  }
}

// It ends by itself: the program that asked for it may be gone.
TEST_P(JointReleaseOf, EndsWithoutItsClientOnBusThread) {
  FallingArm arm(GetParam());
  ASSERT_TRUE(arm.release(kMaxRelease, -1.9, 1.9));
  EXPECT_NEAR(arm.cycles_until_caught(0) * kCyclePeriod, kMaxRelease, 0.02);
  arm.expect_held();
}

TEST_P(JointReleaseOf, IsRefusedWhereItIsNotSafe) {
  FallingArm arm(GetParam());
  const auto why = [&](double duration, double lower, double upper, double speed) {
    return arm.release(duration, lower, upper, speed).why();
  };
  EXPECT_THAT(why(2.5, 0, 1.2, 3), HasSubstr("may be at most 2 s"));
  EXPECT_THAT(why(std::nan(""), 0, 1.2, 3), HasSubstr("may be at most 2 s"));
  EXPECT_THAT(why(1, 0, 0.5, 3), HasSubstr("not within 0 to 0.5"));
  EXPECT_THAT(why(1, 0, 1.2, 0), HasSubstr("its speed is not positive"));
  EXPECT_THAT(arm.bench.driver->release_joint({"j4", 1, 0, 1, 1}).why(),
              HasSubstr("no servo with the name 'j4'"));
  arm.bench.commands[0] = 0.5;
  ASSERT_EQ(arm.bench.run(0.05), HardwareReturn::ok);
  EXPECT_THAT(why(1, 0, 1.2, 3), HasSubstr("'j1' is moved by a controller"));
  ASSERT_EQ(arm.bench.run(1.0), HardwareReturn::ok);
  ASSERT_TRUE(arm.release());
  EXPECT_THAT(why(1, 0, 1.2, 3), HasSubstr("'j2' is released"));
  arm.bench.driver->on_stop();
  EXPECT_THAT(why(1, 0, 1.2, 3), HasSubstr("the arm is stopped"));
}

TEST_P(JointReleaseOf, GentleArmRefuses) {
  FallingArm arm(GetParam(), "<param name=\"gentle\">always</param><param name=\"rate\">1000000</param>");
  EXPECT_THAT(arm.release().why(), HasSubstr("the arm is gentle"));
  EXPECT_TRUE(arm.torque());
}

TEST_P(JointReleaseOf, UnconfirmedReleaseIsRefusedAndHeld) {
  FallingArm arm(GetParam());
  EmulatedFault drop{.kind = FaultKind::drop, .share = 1};
  drop.begin = arm.bench.machine.now;
  drop.end = drop.begin + from_seconds(0.05);
  arm.bench.devices.add_fault(drop);
  EXPECT_FALSE(arm.release(2.0));
  for (int i = 0; i < 15; ++i) static_cast<void>(arm.fall(-0.5));
  EXPECT_TRUE(arm.torque());
  arm.expect_held();
}

INSTANTIATE_TEST_SUITE_P(Protocols, JointReleaseOf,
                         testing::Values("doppel/FeetechSts", "doppel/DynamixelX"));

// A servo with a latched overload confirms the write of its torque, and stays without it.
TEST(JointRelease, ServoThatRefusesItsTorqueIsNotCaught) {
  FallingArm arm("doppel/DynamixelX");
  ASSERT_TRUE(arm.release(0.3));
  arm.bench.devices.add_fault({.kind = FaultKind::overload, .servo = 2, .begin = arm.bench.machine.now});
  EXPECT_EQ(arm.cycles_until_caught(0, 60), -1);
  EXPECT_TRUE(arm.report().released);
  EXPECT_EQ(arm.report().torque_on, Time{});
}

TEST(RestWatch, RestIsTimeWithinBand) {
  RestWatch watch(0.01);
  Time now{};
  EXPECT_FALSE(watch.is_at_rest(now));
  for (int i = 0; i <= 20; ++i) watch.take(i % 2 == 0 ? 0.0 : 0.008, now += from_seconds(0.01));
  EXPECT_TRUE(watch.is_at_rest(now));
  watch.take(0.02, now);
  EXPECT_FALSE(watch.is_at_rest(now));
}

TEST(ReleaseWatch, FirstReasonStays) {
  ReleaseWatch watch;
  Time now{};
  watch.begin({"j", 1.0, -1, 1, 2}, 0, now);
  EXPECT_EQ(watch.take(true, 0.01, 1, now += from_seconds(0.01)), CatchReason::none);
  EXPECT_EQ(watch.take(false, 0.01, 1, now += from_seconds(0.01)), CatchReason::none);
  EXPECT_EQ(watch.take(false, 0.01, 1, now += from_seconds(0.01)), CatchReason::silence);
  EXPECT_EQ(watch.take(true, 5, 1, now += from_seconds(0.01)), CatchReason::silence);
  watch.begin({"j", 1.0, -1, 1, 2}, 0, now);
  EXPECT_EQ(watch.take(true, 0.05, 0, now += from_seconds(0.01)), CatchReason::speed)
      << "5 rad/s by positions";
}

}  // namespace
}  // namespace doppel
