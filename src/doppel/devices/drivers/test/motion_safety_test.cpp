// Properties of every run of the driver, over random poses, loads, motions, faults and stops. A failure
// prints its seed.
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <random>

#include "doppel/devices/drivers/test/driver_bench.h"

namespace doppel {
namespace {

using test::DriverBench;

constexpr int kSeeds = 200;
constexpr double kSpeed = 4, kLimit = 2;                              // of the bench's joints: rad/s, rad
constexpr double kServoTick = 2 * M_PI / 4096;                        // rad
constexpr double kMaxAhead = 0.05 * kSpeed;                           // rad: 50 ms of motion
constexpr double kMaxActivationMotion = 0.01, kMaxStopMotion = 0.05;  // rad
constexpr double kBrake = 100;  // rad/s^2, what the servo's motor brakes with at least

constexpr std::array kRandomFaults{FaultKind::drop,      FaultKind::corrupt, FaultKind::late,
                                   FaultKind::stranger,  FaultKind::echo,    FaultKind::unplug,
                                   FaultKind::brown_out, FaultKind::stuck,   FaultKind::slip,
                                   FaultKind::hot,       FaultKind::overload};
constexpr std::array kPermanent{ServoRole::id,
                                ServoRole::baud_rate,
                                ServoRole::return_delay,
                                ServoRole::operating_mode,
                                ServoRole::homing_offset,
                                ServoRole::min_position,
                                ServoRole::max_position};

class RandomRun {
 public:
  explicit RandomRun(int seed)
      : random_(static_cast<std::uint64_t>(seed)),
        bench_(seed % 2 == 0 ? "doppel/DynamixelX" : "doppel/FeetechSts") {
    for (std::size_t i = 0; i < 3; ++i) {
      bench_.machine.states[i].position = number(-1.9, 1.9);
      bench_.machine.loads[i] = number(-0.5, 0.5);
    }
    for (RegisterServo& one : bench_.devices.servos())
      one.set(ServoRole::goal_position, static_cast<std::int64_t>(random_() % 4096));
    wait(0.02);
    permanent_ = permanent();
  }

  void run() {
    if (chance(0.2)) add_fault();
    if (!activate()) return check_permanent();
    const int cycles = static_cast<int>(number(50, 250));
    const int stop_at = chance(0.5) ? static_cast<int>(number(0, cycles)) : -1;
    const int fault_at = chance(0.7) ? static_cast<int>(number(0, cycles)) : -1;
    for (int i = 0; i < cycles; ++i) {
      if (i == fault_at) add_fault();
      if (i == stop_at) return stop();
      command(i);
      if (bench_.cycle() != HardwareReturn::ok) return recover();
      check_goals();
      if (testing::Test::HasFatalFailure()) return;
    }
    check_permanent();
  }

 private:
  double number(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  bool chance(double share) { return number(0, 1) < share; }
  void wait(double seconds) {
    for (int i = 0; i < static_cast<int>(1000 * seconds); ++i) bench_.machine.step();
    if (bench_.link != nullptr) bench_.link->follow(bench_.machine.now);
  }
  [[nodiscard]] bool any_torque() {
    return std::ranges::any_of(bench_.devices.servos(), [](const RegisterServo& one) {
      return one.value(ServoRole::torque_enable) != 0;
    });
  }
  std::vector<std::int64_t> permanent() {
    std::vector<std::int64_t> out;
    for (const RegisterServo& one : bench_.devices.servos()) {
      for (const ServoRole role : kPermanent) out.push_back(one.value(role));
    }
    return out;
  }
  void check_permanent() {
    EXPECT_EQ(permanent(), permanent_) << "the EEPROM is written only after a question";
  }

  void add_fault() {
    EmulatedFault fault;
    fault.kind = kRandomFaults[random_() % kRandomFaults.size()];
    // Several servos with each other's ids look like servos whose answers are lost.
    if (fault.kind == FaultKind::stranger || chance(0.5)) fault.servo = 1 + static_cast<int>(random_() % 3);
    fault.begin = bench_.machine.now;
    fault.end = fault.begin + from_seconds(number(0.01, 1.0));
    fault.share = chance(0.5) ? 1 : number(0.05, 0.5);
    if (fault.kind == FaultKind::late) fault.amount = number(0.001, 0.02);
    if (fault.kind == FaultKind::slip) {
      fault.amount = number(-0.1, 0.1);
      slip_ += std::abs(fault.amount);
    }
    if (fault.kind == FaultKind::hot) fault.amount = number(50, 80);
    kind_ = fault.kind;
    bench_.devices.add_fault(fault);
  }

  // False: it is refused, and no torque is on.
  bool activate() {
    if (!bench_.initialise()) return false;
    const bool connected = bench_.driver->on_configure().ok();
    EXPECT_FALSE(any_torque());
    if (!connected || !bench_.driver->on_activate()) {
      EXPECT_EQ(bench_.driver->state() == DriverState::active, false);
      return false;
    }
    bench_.claim();
    std::array<double, 3> before{};
    for (std::size_t i = 0; i < 3; ++i) before[i] = bench_.q(i);
    for (int i = 0; i < 20; ++i) {
      if (bench_.cycle() != HardwareReturn::ok) return false;
      for (std::size_t joint = 0; joint < 3; ++joint)
        EXPECT_NEAR(bench_.q(joint), before[joint], kMaxActivationMotion + slip_) << to_string(kind_);
    }
    return true;
  }

  // A sum of sines, with a command far away now and then.
  void command(int cycle) {
    if (cycle == 0) {
      for (double& one : phases_) one = number(0, 6.28);
      for (double& one : rates_) one = number(0.5, 6);
    }
    for (std::size_t i = 0; i < 3; ++i)
      bench_.commands[i] = 1.8 * std::sin(rates_[i] * 0.01 * cycle + phases_[i]);
    if (chance(0.02)) bench_.commands[random_() % 3] = number(-4, 4);
  }

  [[nodiscard]] double goal(std::size_t joint) {
    const RegisterServo& servo = bench_.devices.servos()[joint];
    return servo.model().angle(servo.value(ServoRole::goal_position));
  }
  void check_goals() {
    DeviceReport report;
    ASSERT_TRUE(bench_.driver->report(report));
    for (std::size_t i = 0; i < 3; ++i) {
      if (bench_.devices.servos()[i].value(ServoRole::torque_enable) == 0) continue;  // it has lost its power
      ASSERT_LE(std::abs(goal(i)), kLimit + kServoTick) << "joint " << i << ", " << to_string(kind_);
      ASSERT_LE(std::abs(report.joints[i].goal - report.joints[i].position), 2 * kMaxAhead)
          << "joint " << i << ", " << to_string(kind_);
    }
  }

  void stop() {
    std::array<double, 3> before{}, speed{}, goals{};
    for (std::size_t i = 0; i < 3; ++i) {
      before[i] = bench_.q(i);
      speed[i] = bench_.machine.states[i].velocity;
    }
    bench_.driver->on_stop();
    for (int i = 0; i < 2; ++i) static_cast<void>(bench_.cycle());
    for (std::size_t i = 0; i < 3; ++i) goals[i] = goal(i);
    for (int i = 0; i < 50; ++i) {
      if (bench_.cycle() != HardwareReturn::ok) break;
      for (std::size_t joint = 0; joint < 3; ++joint) {
        if (bench_.devices.servos()[joint].value(ServoRole::torque_enable) == 0) continue;
        EXPECT_EQ(goal(joint), goals[joint]) << to_string(kind_);
        // A bus that is gone takes no stop: the motion goes on to the last goal, at most 50 ms ahead.
        const double most = kMaxStopMotion + speed[joint] * speed[joint] / (2 * kBrake) + kMaxAhead + slip_;
        EXPECT_NEAR(bench_.q(joint), before[joint], most) << to_string(kind_);
      }
    }
    check_permanent();
  }

  // After a fault: nothing is resumed.
  void recover() {
    static_cast<void>(bench_.driver->on_error());
    wait(2);
    std::array<double, 3> before{};
    for (std::size_t i = 0; i < 3; ++i) before[i] = bench_.q(i);
    bench_.commands.assign(3, std::nan(""));
    if (!bench_.driver->on_configure() || !bench_.driver->on_activate()) return check_permanent();
    bench_.claim();
    for (int i = 0; i < 50; ++i) {
      if (bench_.cycle() != HardwareReturn::ok) break;
      for (std::size_t joint = 0; joint < 3; ++joint)
        EXPECT_NEAR(bench_.q(joint), before[joint], kMaxActivationMotion + slip_) << to_string(kind_);
    }
    check_permanent();
  }

  std::mt19937_64 random_;
  DriverBench bench_;
  std::vector<std::int64_t> permanent_;
  std::array<double, 3> phases_{}, rates_{};
  double slip_ = 0;  // rad: of horns that turn on their shafts, which no goal causes
  FaultKind kind_ = FaultKind::drop;
};

TEST(MotionSafety, RandomRunsWithFaultsAndStopsKeepBounds) {
  for (int seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    RandomRun(seed).run();
    if (testing::Test::HasFailure()) {
      std::cout << "failed with seed " << seed << "\n";
      return;
    }
  }
}

}  // namespace
}  // namespace doppel
