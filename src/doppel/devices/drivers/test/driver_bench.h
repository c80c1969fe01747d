#pragma once
// A driver on an emulated bus in simulated time: the controllers' side is the test, the motors' side a
// TestMachine.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "doppel/description/urdf/load.h"
#include "doppel/devices/drivers/servo_hardware.h"
#include "doppel/devices/drivers/test/lossy_link.h"
#include "doppel/devices/emulation/bus_emulator.h"
#include "doppel/devices/emulation/emulated_link.h"
#include "doppel/devices/emulation/test/test_machine.h"

namespace doppel::test {

// Three joints of -2 to 2 rad and 4 rad/s; the servos have the ids 1 to 3, all directions and zeros are the
// plain ones.
inline std::string three_joints(const std::string& plugin, const std::string& params,
                                const std::string& joint_params) {
  std::string out = R"(<robot name="three"><link name="l0"/>)";
  std::string hardware = "<ros2_control name=\"Arm\" type=\"system\"><hardware><plugin>" + plugin +
                         "</plugin>" + params + "</hardware>";
  for (int i = 1; i <= 3; ++i) {
    const std::string n = std::to_string(i), before = std::to_string(i - 1);
    out += "<link name=\"l" + n + "\"/><joint name=\"j" + n + "\" type=\"revolute\"><parent link=\"l" +
           before + "\"/><child link=\"l" + n +
           "\"/><axis xyz=\"0 0 1\"/><limit lower=\"-2\" upper=\"2\" effort=\"1\" velocity=\"4\"/></joint>";
    hardware += "<joint name=\"j" + n + "\"><param name=\"id\">" + n + "</param>" + joint_params +
                R"(<command_interface name="position"/><state_interface name="position"/>)"
                R"(<state_interface name="velocity"/></joint>)";
  }
  return out + hardware + "</ros2_control></robot>";
}

struct DriverBench {
  explicit DriverBench(const std::string& plugin = "doppel/FeetechSts",
                       const std::string& params = gentle_off(),
                       const std::string& joint_params = "<param name=\"offset_deg\">0</param>")
      : robot(parse_urdf(three_joints(plugin, params, joint_params), "three.urdf", packages, diagnostics)),
        model(compile_model(robot, BaseKind::fixed, diagnostics)),
        servo(plugin.find("ynamixel") != std::string::npos ? *find_servo_model("XL430-W250")
                                                           : *find_servo_model("STS3215")),
        devices(servo.protocol, servos_of(servo)),
        machine(devices, 3) {
    log.add_sink([this](const LogLine& line) { logged += line.text + "\n"; });
    driver = std::make_unique<ServoHardware>([this](const ServoSetup& setup) {
      auto out = std::make_unique<LossyLink>(loses, devices, "emulated", setup.rate);
      link = out.get();
      link->follow(machine.now);
      return out;
    });
    for (int i = 0; i < 10; ++i) machine.step();
  }
  static std::string gentle_off() {
    return "<param name=\"gentle\">never</param><param name=\"rate\">1000000</param>";
  }
  static std::vector<RegisterServo> servos_of(const ServoModel& model) {
    std::vector<RegisterServo> out;
    for (int id = 1; id <= 3; ++id) {
      out.emplace_back(model, id);
      out.back().set(ServoRole::baud_rate, model.protocol == ServoProtocol::feetech ? 0 : 3);
      out.back().set(ServoRole::return_delay, 0);
    }
    return out;
  }

  Status initialise() {
    const HardwareInfo with{robot.hardware.front(), model, log, 100, diagnostics};
    const Status out = driver->on_init(with);
    states.assign(driver->state_interfaces().size(), 0);
    commands.assign(driver->command_interfaces().size(), std::nan(""));
    return out;
  }
  // Up to an active component with claimed joints.
  void start() {
    ASSERT_TRUE(initialise());
    const Status configured = driver->on_configure();
    ASSERT_TRUE(configured) << configured.why();
    const Status activated = driver->on_activate();
    ASSERT_TRUE(activated) << activated.why();
    claim();
  }
  void claim() {
    std::vector<std::string> names;
    for (const InterfaceDescription& one : driver->command_interfaces()) names.push_back(one.full_name());
    driver->perform_switch(names, {});
  }
  // A cycle of 10 ms: the answer of read, or of write.
  HardwareReturn cycle(bool writes = true) {
    constexpr Duration kPeriod{10'000'000};
    for (int i = 0; i < 10; ++i) machine.step();
    if (link != nullptr) link->follow(machine.now);
    const HardwareReturn answer = driver->read(machine.now, kPeriod, states);
    if (answer != HardwareReturn::ok || !writes) return answer;
    return driver->write(machine.now, kPeriod, commands);
  }
  HardwareReturn run(double seconds, bool writes = true) {
    const auto cycles = static_cast<int>(std::lround(seconds * 100));
    for (int i = 0; i < cycles; ++i) {
      if (const HardwareReturn answer = cycle(writes); answer != HardwareReturn::ok) return answer;
    }
    driver->attend();
    return HardwareReturn::ok;
  }
  [[nodiscard]] double q(std::size_t joint) const { return machine.states[joint].position; }

  Diagnostics diagnostics;
  PackageResolver packages;
  Log log;
  std::string logged;
  RobotDescription robot;
  Model model;
  const ServoModel& servo;
  BusEmulator devices;
  TestMachine machine;
  LossyLink::Loses loses;  // the requests that do not reach the servos
  EmulatedLink* link = nullptr;
  std::unique_ptr<ServoHardware> driver;
  std::vector<double> states, commands;
};

}  // namespace doppel::test
