// The driver of hobby servos against the firmware itself: poses are believed, and confirmed by a person
// after each loss of power.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "doppel/devices/drivers/pose_record.h"
#include "doppel/devices/drivers/test/driver_bench.h"
#include "doppel/devices/emulation/board_emulator.h"
#include "doppel/devices/frames/servo_line.h"

namespace doppel {
namespace {

using testing::HasSubstr;

constexpr const char* kParams =
    "<param name=\"gentle\">never</param><param name=\"port\">emulated</param><param "
    "name=\"travel_deg\">240</param>";

struct LineBench {
  explicit LineBench(const std::string& params = "")
      : robot(parse_urdf(
            test::three_joints("doppel/ServoLine", kParams + params, "<param name=\"offset_deg\">0</param>"),
            "three.urdf", packages, diagnostics)),
        model(compile_model(robot, BaseKind::fixed, diagnostics)),
        folder(std::filesystem::temp_directory_path() / ("poses_" + std::to_string(::getpid()))),
        devices({servo(1), servo(2), servo(3)}),
        machine(devices, 3) {
    std::filesystem::remove_all(folder);
    ::setenv("XDG_STATE_HOME", folder.c_str(), 1);
    machine.step();
    plug_in();
  }
  ~LineBench() { std::filesystem::remove_all(folder); }
  static HobbyServo servo(int channel) {
    return {.channel = channel, .travel = 240 * M_PI / 180, .velocity = 6};
  }

  void plug_in() {
    driver = std::make_unique<ServoHardware>([this](const ServoSetup& setup) {
      auto out = std::make_unique<EmulatedLink>(devices, "emulated", setup.rate);
      link = out.get();
      link->set_world([this](Time when) {
        while (machine.now < when) machine.step();
      });
      link->follow(machine.now);
      return out;
    });
    const HardwareInfo with{robot.hardware.front(), model, log, 50, diagnostics};
    static_cast<void>(driver->on_init(with));
    states.assign(driver->state_interfaces().size(), 0);
    commands.assign(3, std::nan(""));
  }
  void confirm(std::vector<double> pose) {
    // The same as `doppel hardware confirm`: the board's boot id with the pose that the person has seen.
    FrameBytes hello;
    add_servo_line("H 1 1", hello);
    EmulatedLink other(devices, "confirm", 115200);
    other.follow(machine.now);
    other.write(hello.bytes());
    ServoLineReader reader;
    std::array<std::uint8_t, 200> bytes{};
    PoseRecord record;
    while (const std::size_t count = other.read(bytes, other.now() + from_seconds(0.1))) {
      reader.push(std::span(bytes).first(count));
      while (const auto body = reader.next()) {
        const ServoLineReply reply = parse_servo_reply(*body);
        if (const auto* const identity = std::get_if<ServoLineIdentity>(&reply)) record.boot = identity->boot;
      }
    }
    for (std::size_t i = 0; i < 3; ++i) record.positions.emplace_back("j" + std::to_string(i + 1), pose[i]);
    write_pose_record(pose_record_file("Arm", "emulated"), record);
    while (machine.now < other.now()) machine.step();
  }
  void start() {
    const Status configured = driver->on_configure();
    ASSERT_TRUE(configured) << configured.why();
    const Status activated = driver->on_activate();
    ASSERT_TRUE(activated) << activated.why();
    std::vector<std::string> names;
    for (const InterfaceDescription& one : driver->command_interfaces()) names.push_back(one.full_name());
    driver->perform_switch(names, {});
  }
  HardwareReturn run(double seconds) {
    constexpr Duration kPeriod{20'000'000};
    const Time end = machine.now + from_seconds(seconds);
    while (machine.now < end) {
      const Time next = machine.now + kPeriod;
      link->follow(machine.now);
      if (const auto answer = driver->read(machine.now, kPeriod, states); answer != HardwareReturn::ok)
        return answer;
      if (const auto answer = driver->write(machine.now, kPeriod, commands); answer != HardwareReturn::ok)
        return answer;
      while (machine.now < next) machine.step();
    }
    driver->attend();
    return HardwareReturn::ok;
  }
  [[nodiscard]] double q(std::size_t joint) const { return machine.states[joint].position; }

  Diagnostics diagnostics;
  PackageResolver packages;
  Log log;
  RobotDescription robot;
  Model model;
  std::filesystem::path folder;
  BoardEmulator devices;
  test::TestMachine machine;
  EmulatedLink* link = nullptr;
  std::unique_ptr<ServoHardware> driver;
  std::vector<double> states, commands;
};

TEST(ServoLineDriver, UnconfirmedPoseMovesNothing) {
  LineBench bench;
  ASSERT_TRUE(bench.driver->on_configure());
  const Status status = bench.driver->on_activate();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.why(), HasSubstr("doppel hardware confirm"));
  for (int channel = 1; channel <= 3; ++channel) EXPECT_EQ(bench.devices.pulse(channel), 0);
}

TEST(ServoLineDriver, ConfirmedArmStartsWhereItStands) {
  LineBench bench;
  const std::vector<double> pose{0.5, -0.4, 1.2};
  for (std::size_t i = 0; i < 3; ++i) bench.machine.states[i].position = pose[i];
  bench.confirm(pose);
  bench.start();
  ASSERT_EQ(bench.run(0.5), HardwareReturn::ok);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(bench.q(i), pose[i], 0.005);
  bench.commands = {0, 0, 0};
  ASSERT_EQ(bench.run(1.5), HardwareReturn::ok);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(bench.q(i), 0, 0.005);
  DeviceReport report;
  ASSERT_TRUE(bench.driver->report(report));
  EXPECT_TRUE(report.joints.front().believed);
  EXPECT_THAT(bench.driver->release_joint({report.joints.front().name, 1, -1, 1, 1}).why(),
              HasSubstr("its servo reports no positions"));
}

TEST(ServoLineDriver, SecondOpeningOfPortMovesNoServo) {
  LineBench bench;
  bench.confirm({0, 0, 0});
  bench.start();
  bench.commands = {0.8, 0.8, 0.8};
  bench.run(1.0);
  ASSERT_TRUE(bench.driver->on_deactivate());
  ASSERT_TRUE(bench.driver->on_cleanup());
  bench.plug_in();
  bench.start();
  bench.run(0.5);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(bench.q(i), 0.8, 0.005);
}

TEST(ServoLineDriver, ParkedPoseIsUsedForOneStart) {
  LineBench bench;
  const auto file = pose_record_file("Arm", "emulated");
  write_pose_record(file, {.parked = true, .positions = {{"j1", 0}, {"j2", 0}, {"j3", 0}}});
  bench.start();
  ASSERT_EQ(bench.run(0.2), HardwareReturn::ok);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(bench.q(i), 0, 0.005);
  EXPECT_FALSE(read_pose_record(file)) << "the arm may move, and the record would say that it has not";
}

TEST(ServoLineDriver, LostSupplyFaultsAndNeedsConfirmationAgain) {
  LineBench bench;
  bench.confirm({0, 0, 0});
  bench.start();
  bench.commands = {0.8, 0.8, 0.8};
  bench.run(0.2);
  bench.devices.add_fault({.kind = FaultKind::brown_out,
                           .begin = bench.machine.now,
                           .end = bench.machine.now + from_seconds(0.1)});
  EXPECT_EQ(bench.run(2.0), HardwareReturn::error);
  ASSERT_TRUE(bench.driver->on_error());
  for (int i = 0; i < 500; ++i) bench.machine.step();
  ASSERT_TRUE(bench.driver->on_configure());
  EXPECT_FALSE(bench.driver->on_activate());
}

TEST(ServoLineDriver, SilentHostHoldsByWatchdogOfBoard) {
  LineBench bench;
  bench.confirm({0, 0, 0});
  bench.start();
  bench.commands = {1.9, 1.9, 1.9};
  bench.run(0.2);
  for (int i = 0; i < 400; ++i) bench.machine.step();
  const double held = bench.q(0);
  for (int i = 0; i < 1000; ++i) bench.machine.step();
  EXPECT_NEAR(bench.q(0), held, 0.002);
  EXPECT_LT(held, 1.8);
}

TEST(ServoLineDriver, StopPinFaultsAndNextActivationGoesOn) {
  LineBench bench;
  bench.confirm({0, 0, 0});
  bench.start();
  bench.commands = {1.5, 1.5, 1.5};
  bench.run(0.2);
  bench.devices.press_stop(true);
  EXPECT_EQ(bench.run(2.0), HardwareReturn::error);
  EXPECT_THAT(bench.driver->fault(), HasSubstr("the stop pin of the board is active"));
  const double held = bench.q(0);
  EXPECT_LT(held, 1.4);
  ASSERT_TRUE(bench.driver->on_error());
  bench.devices.press_stop(false);
  bench.start();
  bench.commands.assign(3, std::nan(""));
  ASSERT_EQ(bench.run(0.5), HardwareReturn::ok);
  EXPECT_NEAR(bench.q(0), held, 0.01);
}

}  // namespace
}  // namespace doppel
