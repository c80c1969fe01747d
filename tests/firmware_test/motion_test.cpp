// The pulses of the servos' firmware: when there are any, how they move, and what stops them.
#include <cmath>
#include <random>

#include "bench.h"

namespace doppel {
namespace {

using Flag = ServoLineState::Flag;
using doppel_servo::Ramp;

// -- the ramp alone

struct RampCase {
  std::uint32_t start, target, speed, acceleration;
};

class RampForms : public testing::TestWithParam<RampCase> {};

// Position after t seconds from rest, with bounded speed and acceleration.
double closed_form(double distance, double speed, double acceleration, double t) {
  const double peak = std::min(speed, std::sqrt(distance * acceleration));
  const double rise = peak / acceleration, cruise = (distance - peak * rise) / peak,
               total = 2 * rise + cruise;
  if (t <= 0) return 0;
  if (t < rise) return acceleration * t * t / 2;
  if (t < rise + cruise) return peak * (t - rise / 2);
  if (t < total) return distance - acceleration * (total - t) * (total - t) / 2;
  return distance;
}

double duration(double distance, double speed, double acceleration) {
  const double peak = std::min(speed, std::sqrt(distance * acceleration));
  return distance / peak + peak / acceleration;
}

TEST_P(RampForms, FollowsClosedFormWithoutOvershoot) {
  const RampCase c = GetParam();
  Ramp ramp;
  ramp.set_limits(500, 2500, c.speed, c.acceleration);
  ramp.begin(c.start);
  ramp.aim(c.target);
  const double distance = std::abs(static_cast<double>(c.target) - c.start),
               sign = c.target > c.start ? 1 : -1;
  const double peak = std::min<double>(c.speed, std::sqrt(distance * c.acceleration));
  // The speed and the acceleration are rounded down to 2^-32 us per ms and per ms^2: at 1 us/s^2 by 0.03 %.
  const double rounding = 3e-4 * distance * 4 / std::max<double>(4, c.acceleration);
  int steps = 0;
  double before = 0;
  while (!ramp.at_rest()) {
    ramp.step();
    ++steps;
    ASSERT_LT(steps, 200000);
    const double moved = sign * (ramp.nanoseconds() / 1000.0 - c.start);
    ASSERT_LE(moved, distance);
    ASSERT_GE(moved, before - 0.0011);
    ASSERT_LE(moved - before, c.speed * 1e-3 + 0.0011);
    // A step moves with the speed of its end, so that the discrete ramp is half a step ahead, and as late at
    // its end.
    ASSERT_NEAR(moved, closed_form(distance, c.speed, c.acceleration, steps * 1e-3),
                peak * 1.1e-3 + 0.01 + rounding)
        << steps;
    before = moved;
  }
  EXPECT_EQ(ramp.microseconds(), c.target);
  EXPECT_EQ(ramp.nanoseconds(), c.target * 1000);
  EXPECT_NEAR(steps, 1000 * duration(distance, c.speed, c.acceleration), 2.5 + 30 * rounding);
}

INSTANTIATE_TEST_SUITE_P(Cases, RampForms,
                         testing::Values(RampCase{500, 2500, 1000, 4000}, RampCase{2500, 500, 1000, 4000},
                                         RampCase{1500, 1501, 1000, 4000}, RampCase{1000, 2000, 100000, 3000},
                                         RampCase{1500, 1600, 333, 777}, RampCase{500, 2500, 5000, 100000},
                                         RampCase{1500, 1520, 1, 1}, RampCase{500, 2500, 100000, 10000000},
                                         RampCase{1500, 1490, 7, 10000000}, RampCase{500, 2500, 2000, 1},
                                         RampCase{500, 2500, 6667, 33333}));

TEST(ServoRamp, NewTargetsKeepSpeedAccelerationAndLimits) {
  const std::uint64_t seed = 20261128;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  for (int run = 0; run < 300; ++run) {
    const auto speed = static_cast<std::uint32_t>(1 + random() % 10000);
    const auto acceleration = static_cast<std::uint32_t>(1 + random() % 60000);
    Ramp ramp;
    ramp.set_limits(900, 2100, speed, acceleration);
    ramp.begin(static_cast<std::uint32_t>(900 + random() % 1201));
    std::int64_t before = ramp.nanoseconds(), moved = 0;
    for (int step = 0; step < 3000; ++step) {
      if (random() % 60 == 0) ramp.aim(static_cast<std::uint32_t>(900 + random() % 1201));
      if (random() % 500 == 0) ramp.freeze();
      ramp.step();
      const std::int64_t now = ramp.nanoseconds();
      ASSERT_GE(now, 900000);
      ASSERT_LE(now, 2100000);
      ASSERT_LE(std::abs(now - before), speed + 1);
      ASSERT_LE(std::abs(now - before - moved) * 1000, acceleration + 2000);
      moved = now - before;
      before = now;
    }
  }
}

TEST(ServoRamp, FreezeStopsInShortestDistance) {
  for (const std::uint32_t target : {2500U, 500U}) {
    Ramp ramp;
    ramp.set_limits(500, 2500, 1000, 4000);
    ramp.begin(1500);
    ramp.aim(target);
    for (int i = 0; i < 400; ++i) ramp.step();
    const double place = ramp.nanoseconds() / 1000.0, sign = target == 2500 ? 1 : -1;
    ramp.freeze();
    int steps = 0;
    for (; !ramp.at_rest(); ++steps) ramp.step();
    EXPECT_NEAR(sign * (ramp.nanoseconds() / 1000.0 - place), 1000.0 * 1000 / 2 / 4000, 1.0);  // v^2 / 2a
    EXPECT_NEAR(steps, 250, 1);                                                                // v / a
  }
}

// -- pulses of the firmware

TEST_F(ServoFirmware, NoPulseBeforeEnable) {
  firmware.tick();
  say("H 1 1");
  say("C 0 500 2500 1000 4000");
  say("P 1 1500 1500 1500");
  pass(100);
  EXPECT_EQ(board.pulses, 0U);
  EXPECT_EQ(say("E 1"), "A E 1");
  pass(100);
  EXPECT_EQ(board.pulses, 0U);
}

TEST_F(ServoFirmware, EnableWithoutLimitsOfOneChannelIsRefusedWhole) {
  firmware.tick();
  say("H 1 1");
  say("C 0 500 2500 1000 4000");
  say("C 2 500 2500 1000 4000");
  EXPECT_EQ(say("E 7"), "! 5 no C for channel 1");
  EXPECT_EQ(firmware.enabled_mask(), 0U);
  say("P 1 1500 1500 1500");
  EXPECT_EQ(board.pulses, 0U);
  EXPECT_EQ(say("E 5"), "A E 5");
}

TEST_F(ServoFirmware, FirstTargetSetsWhereRampBegins) {
  ready("1");
  say("P 1 2200");
  EXPECT_EQ(width(0), 2200000);
  say("P 2 1200");
  EXPECT_EQ(width(0), 2200000);
  pass(1);
  EXPECT_LT(width(0), 2200000);
  EXPECT_GT(width(0), 2199900);
}

TEST_F(ServoFirmware, TargetsReachOnlyEnabledChannels) {
  ready("2");
  say("P 1 1100 1200 1300");
  EXPECT_EQ(width(0), 0);
  EXPECT_EQ(width(1), 1200000);
  EXPECT_EQ(width(2), 0);
}

TEST_F(ServoFirmware, ChannelsAreEnabledOneAfterOther) {
  ready("1");
  say("P 1 1100 1200 1300");
  pass(150);
  EXPECT_EQ(say("E 3"), "A E 3");
  EXPECT_EQ(width(1), 0);
  say("P 2 1600 1200 1300");
  pass(100);
  const std::int64_t on_the_way = width(0);
  EXPECT_GT(on_the_way, 1100000);
  EXPECT_EQ(width(1), 1200000);
  EXPECT_EQ(say("E 7"), "A E 7");  // the ramp of channel 0 goes on
  say("P 3 - - 1300");
  pass(1);
  EXPECT_GT(width(0), on_the_way);
  EXPECT_EQ(width(2), 1300000);
}

TEST_F(ServoFirmware, DashKeepsTarget) {
  ready("3");
  say("P 1 1500 1500");
  say("P 2 1600 -");
  say("P 3 -");
  pass_with_host(1000);
  EXPECT_EQ(width(0), 1600000);
  EXPECT_EQ(width(1), 1500000);
}

TEST_F(ServoFirmware, DashAsFirstTargetMakesNoPulse) {
  ready("3");
  say("P 1 - 1500");
  pass(10);
  EXPECT_EQ(width(0), 0);
  EXPECT_EQ(width(1), 1500000);
}

TEST_F(ServoFirmware, ChannelLeftOutOfMaskLosesPulse) {
  ready("3");
  say("P 1 1500 1500");
  EXPECT_EQ(say("E 1"), "A E 1");
  EXPECT_EQ(width(0), 1500000);
  EXPECT_EQ(width(1), 0);
  say("E 3");
  pass(10);
  EXPECT_EQ(width(1), 0);  // as after the first E: it waits for a target
}

TEST_F(ServoFirmware, TargetOutsideLimitsIsClampedAndFlagged) {
  ready("1", "1000 2000 1000 4000");
  say("P 1 1990");
  EXPECT_EQ(state().flags, unsigned{Flag::kEnabled});
  say("P 2 2400");
  EXPECT_NE(state().flags & Flag::kClamped, 0U);
  pass_with_host(500);
  EXPECT_EQ(width(0), 2000000);
  say("P 3 -");
  EXPECT_NE(state().flags & Flag::kClamped, 0U);
  say("P 4 2000");
  EXPECT_EQ(state().flags & Flag::kClamped, 0U);
}

TEST_F(ServoFirmware, RampingIsFlaggedUntilRest) {
  ready("1");
  say("P 1 1500");
  say("P 2 1510");
  EXPECT_EQ(state().flags, unsigned{Flag::kEnabled | Flag::kRamping});
  pass_with_host(200);
  EXPECT_EQ(state().flags, unsigned{Flag::kEnabled});
  EXPECT_EQ(state().pulses[0], 1510);
}

TEST_F(ServoFirmware, MotionTakesTimeOfTrapezoid) {
  ready("1");
  say("P 1 1000");
  say("P 2 2000");  // 1000 us at 1000 us/s and 4000 us/s^2: 1.25 s
  pass_with_host(1240);
  EXPECT_LT(width(0), 2000000);
  pass_with_host(15);
  EXPECT_EQ(width(0), 2000000);
}

TEST_F(ServoFirmware, SlowLoopMovesNoFasterAndCatchesUp) {
  ready("1");
  say("P 1 1000");
  say("P 2 2000");
  for (int i = 0; i < 130; ++i) {
    board.now += 10;
    firmware.tick();
    board.check_motion(10);
    say("Q");
  }
  EXPECT_EQ(width(0), 2000000);
}

TEST_F(ServoFirmware, StalledLoopResumesWithoutJump) {
  ready("1");
  say("W 10000 hold");
  say("P 1 1000");
  say("P 2 2000");
  pass(500);
  const std::int64_t before = width(0);
  board.now += 5000;
  firmware.tick();
  EXPECT_LE(width(0) - before, 20 * 1000 + 1);
  board.check_motion(20);
}

TEST_F(ServoFirmware, ClockThatWrapsAroundChangesNothing) {
  board.now = 4294967295U - 300;
  ready("1");
  say("P 1 1000");
  say("P 2 2000");
  pass_with_host(1260);
  EXPECT_EQ(width(0), 2000000);
  EXPECT_EQ(state().flags, unsigned{Flag::kEnabled});
}

TEST_F(ServoFirmware, OtherLimitsInMotionAreRefused) {
  ready("1");
  say("P 1 1000");
  say("P 2 2000");
  pass(100);
  EXPECT_EQ(say("C 0 500 2500 1000 4000"), "A C 0");  // the same: a host that connects again
  EXPECT_EQ(say("C 0 500 2500 2000 4000"), "! 6 other limits need rest, and a pulse inside them: channel 0");
  pass_with_host(1300);
  EXPECT_EQ(say("C 0 500 1900 2000 4000"), "! 6 other limits need rest, and a pulse inside them: channel 0");
  EXPECT_EQ(say("C 0 500 2000 2000 8000"), "A C 0");
  EXPECT_EQ(width(0), 2000000);
}

// Opening the port again moves nothing (hardware.md, behaviour 28).
TEST_F(ServoFirmware, SecondHelloMovesNothing) {
  ready("7");
  say("P 1 1100 1500 1900");
  pass_with_host(100);
  const std::size_t before = board.pulses;
  say("H 1 2");
  ready("7");
  say("Q");
  pass_with_host(100);
  EXPECT_EQ(board.pulses, before);
  EXPECT_EQ(state().pulses[2], 1900);
}

TEST_F(ServoFirmware, FreezeDeceleratesAndForgetsTarget) {
  ready("1");
  say("P 1 1000");
  say("P 2 2500");
  pass_with_host(500);
  const std::int64_t before = width(0);
  EXPECT_EQ(say("S"), "A S");
  pass_with_host(1000);
  EXPECT_NEAR(static_cast<double>(width(0) - before), 125000, 1500);  // v^2 / 2a
  const std::int64_t rest = width(0);
  say("P 3 -");
  pass_with_host(500);
  EXPECT_EQ(width(0), rest);
  say("P 4 2500");
  pass(10);
  EXPECT_GT(width(0), rest);
}

TEST_F(ServoFirmware, RelaxRemovesPulsesUntilEnabledAgain) {
  ready("3");
  say("P 1 1500 1600");
  EXPECT_EQ(say("R"), "A R");
  EXPECT_EQ(width(0), 0);
  EXPECT_EQ(width(1), 0);
  say("P 2 1500 1600");
  pass(10);
  EXPECT_EQ(width(0), 0);
  say("E 3");
  say("P 3 1700 1600");
  EXPECT_EQ(width(0), 1700000);
}

// -- the watchdog

TEST_F(ServoFirmware, SilenceHoldsByDeceleration) {
  ready("1");
  say("P 1 1000");
  say("P 2 2500");
  pass(300);
  EXPECT_EQ(heard(), "");
  const std::int64_t before = width(0);
  pass(1);
  EXPECT_EQ(heard(), "! 20 held after silence, ms: 300");
  pass(2000);
  EXPECT_EQ(heard(), "");
  EXPECT_NEAR(static_cast<double>(width(0) - before), 126000, 2000);
  EXPECT_NE(state().flags & Flag::kWatchdog, 0U);
}

TEST_F(ServoFirmware, AfterSilenceTargetsAreIgnoredUntilEnable) {
  ready("1");
  say("P 1 1000");
  pass(400);
  heard();
  const ServoLineReply reply = parse_servo_reply(say("P 2 2000"));
  EXPECT_EQ(std::get<ServoLineState>(reply).flags, unsigned{Flag::kEnabled | Flag::kWatchdog});
  pass(100);
  EXPECT_EQ(width(0), 1000000);
  EXPECT_EQ(say("E 1"), "A E 1");
  EXPECT_EQ(width(0), 1000000);
  EXPECT_EQ(state().flags, unsigned{Flag::kEnabled});
  say("P 3 2000");
  pass(100);
  EXPECT_GT(width(0), 1000000);
}

TEST_F(ServoFirmware, SilenceRelaxesWhereHostWantsIt) {
  ready("1");
  EXPECT_EQ(say("W 100 relax"), "A W");
  say("P 1 1000");
  pass(100);
  EXPECT_EQ(width(0), 1000000);
  pass(1);
  EXPECT_EQ(width(0), 0);
  EXPECT_EQ(heard(), "! 20 relaxed after silence, ms: 100");
  EXPECT_EQ(state().flags, unsigned{Flag::kWatchdog});
}

TEST_F(ServoFirmware, EachAcceptedLineIsSignOfLife) {
  ready("1");
  say("P 1 1000");
  for (const char* const body : {"Q", "P 2 -", "H 1 5", "C 1 500 2500 1000 4000", "W 300 hold", "S", "E 1"}) {
    pass(290);
    say(body);
  }
  EXPECT_EQ(state().flags, unsigned{Flag::kEnabled});
}

TEST_F(ServoFirmware, DamagedAndRefusedLinesAreNoSignOfLife) {
  ready("1");
  say("P 1 1000");
  for (int i = 0; i < 31; ++i) {
    pass(10);
    put("noise\n");
    say("Z");
  }
  EXPECT_NE(state().flags & Flag::kWatchdog, 0U);
}

TEST_F(ServoFirmware, SilenceBeforeEnableIsNoFault) {
  firmware.tick();
  say("H 1 1");
  say("C 0 500 2500 1000 4000");
  pass(5000);
  EXPECT_EQ(heard(), "");
  EXPECT_EQ(say("E 1"), "A E 1");
  EXPECT_EQ(state().flags, unsigned{Flag::kEnabled});
}

// -- the stop pin

TEST_F(ServoFirmware, StopPinFreezesUntilReleasedAndEnabled) {
  ready("1");
  say("P 1 1000");
  say("P 2 2500");
  pass_with_host(250);
  const std::int64_t before = width(0);
  heard();
  board.stop = true;
  pass(1);
  EXPECT_EQ(heard(), "! 23 stop pin");
  pass_with_host(1000);
  EXPECT_NEAR(static_cast<double>(width(0) - before), 126000, 2000);
  const std::int64_t rest = width(0);
  say("P 3 2500");
  pass_with_host(100);
  EXPECT_EQ(say("E 1"), "! 7 the stop pin is active");
  board.stop = false;
  pass(1);
  say("P 4 2500");
  pass_with_host(100);
  EXPECT_EQ(width(0), rest);
  EXPECT_NE(state().flags & Flag::kStopPin, 0U);
  EXPECT_EQ(say("E 1"), "A E 1");
  say("P 5 2500");
  pass(10);
  EXPECT_GT(width(0), rest);
  EXPECT_EQ(state().flags, unsigned{Flag::kEnabled | Flag::kRamping});
}

TEST_F(ServoFirmware, StopPinAtStartRefusesEnable) {
  board.stop = true;
  firmware.tick();
  say("H 1 1");
  say("C 0 500 2500 1000 4000");
  EXPECT_EQ(say("E 1"), "! 7 the stop pin is active");
  EXPECT_EQ(say("R"), "A R");
}

// -- the servos' supply

TEST_F(ServoFirmware, BrownOutIsFlaggedAndSentWithHysteresis) {
  board.supply = 5000;
  ready("1");
  say("P 1 1500");
  board.supply = 4290;
  pass(2);
  EXPECT_EQ(heard(), "");
  pass(1);
  EXPECT_EQ(heard(), "! 21 supply low, mV: 4290");
  EXPECT_NE(state().flags & Flag::kBrownOut, 0U);
  board.supply = 4499;
  pass(10);
  EXPECT_NE(state().flags & Flag::kBrownOut, 0U);
  board.supply = 4500;
  pass(3);
  EXPECT_EQ(state().flags & Flag::kBrownOut, 0U);
  board.supply = 4301;
  pass(10);
  EXPECT_EQ(heard(), "");
  EXPECT_EQ(width(0), 1500000);
}

TEST_F(ServoFirmware, SingleLowReadingIsNoBrownOut) {
  board.supply = 5000;
  ready("1");
  for (int i = 0; i < 20; ++i) {
    board.supply = 0;
    pass(2);
    board.supply = 5000;
    pass(1);
  }
  EXPECT_EQ(heard(), "");
}

TEST_F(ServoFirmware, LostSupplyRemovesPulsesAndIsNewBoot) {
  board.supply = 5000;
  ready("1");
  say("P 1 1500");
  const std::uint32_t before = firmware.boot();
  board.supply = 40;
  pass(3);
  EXPECT_EQ(width(0), 0);
  EXPECT_NE(firmware.boot(), before);
  EXPECT_EQ(heard(), "! 22 supply lost, mV: 40 | I doppel-servo 1 3 8F3A00C2 00000000 1.0.0 305");
  board.supply = 5000;
  pass(10);
  EXPECT_EQ(say("P 2 1500"), "T 2 1013 0 5000 0 0 0 a 0 0");
  EXPECT_EQ(say("E 1"), "! 2 no H since the start");
  say("H 1 1");
  EXPECT_EQ(say("E 1"), "! 5 no C for channel 0");
}

TEST_F(ServoFirmware, EnableWithoutSupplyIsRefused) {
  board.supply = 0;
  firmware.tick();
  EXPECT_EQ(heard(), "I doppel-servo 1 3 8F3A00C1 00000000 1.0.0 305 | ! 22 supply lost, mV: 0");
  say("H 1 1");
  say("C 0 500 2500 1000 4000");
  EXPECT_EQ(say("E 1"), "! 8 the servos have no supply");
  EXPECT_EQ(state().millivolts, 1U);  // 0 means that it is not measured
  board.supply = 5000;
  pass(3);
  EXPECT_EQ(say("E 1"), "A E 1");
}

TEST_F(ServoFirmware, SupplyThatIsNotMeasuredIsZeroAndNoFault) {
  ready("1");
  pass_with_host(100);
  EXPECT_EQ(state().millivolts, 0U);
  EXPECT_EQ(state().flags, unsigned{Flag::kEnabled});
}

TEST_F(ServoFirmware, PulsesAreWrittenInTheirPeriod) {
  doppel_servo::Config slow = configured();
  slow.pulse_period_ms = 5;
  WatchedBoard other;
  doppel_servo::Firmware five(other, slow);
  const auto tell = [&](const std::string& body) {
    other.ask(body);
    for (const char byte : whole(body)) five.receive(static_cast<std::uint8_t>(byte));
  };
  tell("H 1 1");
  tell("C 0 500 2500 1000 4000");
  tell("E 1");
  tell("P 1 1000");
  EXPECT_EQ(other.pulses, 1U);
  tell("P 2 1100");
  for (int i = 0; i < 200; ++i) {
    ++other.now;
    five.tick();
  }
  EXPECT_EQ(other.pulses, 41U);
  tell("R");
  EXPECT_EQ(other.channels[0].width, 0);
}

}  // namespace
}  // namespace doppel
