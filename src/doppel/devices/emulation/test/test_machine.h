#pragma once
// Motors for tests of emulated devices: each follows its drive's goal at the drive's speed, without inertia.

#include <algorithm>
#include <cmath>
#include <vector>

#include "doppel/devices/emulation/device_emulator.h"
#include "doppel/devices/emulation/emulated_link.h"

namespace doppel::test {

class TestMachine {
 public:
  TestMachine(DeviceEmulator& devices, std::size_t motors)
      : devices_(devices), states(motors), drives(motors), loads(motors) {}

  // Runs in steps of a millisecond until the link's clock and the motors' have both reached `seconds` later.
  void run(EmulatedLink& link, double seconds) {
    const Time end = link.now() + from_seconds(seconds);
    while (now < end) step();
    link.follow(now);
  }
  void step() {
    constexpr Duration kStep{1'000'000};
    now += kStep;
    for (std::size_t i = 0; i < states.size(); ++i) {
      const MotorDrive& drive = drives[i];
      const double before = states[i].position;
      const double most = drive.velocity * to_seconds(kStep);
      if (drive.on) states[i].position += std::clamp(drive.goal - before, -most, most);
      states[i].velocity = (states[i].position - before) / to_seconds(kStep);
      states[i].effort = std::clamp(loads[i], -drive.effort, drive.effort);
    }
    devices_.step(now, kStep, states, drives);
  }

 private:
  DeviceEmulator& devices_;

 public:
  std::vector<MotorState> states;
  std::vector<MotorDrive> drives;
  std::vector<double> loads;
  Time now{};
};

}  // namespace doppel::test
