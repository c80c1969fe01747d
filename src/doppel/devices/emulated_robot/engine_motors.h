#pragma once
// The joints of a simulated robot as the motors of emulated servos, by the setup of their driver: the
// machine is built as its setup says. What is built otherwise is a fault of the emulation
// (emulation/emulated_faults.h).

#include <vector>

#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/devices/emulation/device_emulator.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

class DOPPEL_API EngineMotors {
 public:
  EngineMotors(const ServoSetup& setup, Instance robot);

  // Before a step: what the joints have reached goes to the devices, and what these make of it to the
  // joints' drives.
  void step(DeviceEmulator& devices, Instance robot, Time now, Duration period);
  // All joints are as without power.
  void release(Instance robot);

 private:
  struct Motor {
    JointServo servo;
    int joint = -1;
    ServoParameters as_compiled;
    bool on = false;
  };
  void apply(Motor& motor, const MotorDrive& drive, Instance robot);

  std::vector<Motor> motors_;
  std::vector<MotorState> states_;
  std::vector<MotorDrive> drives_;
};

// The emulated devices of a setup: its servos with their ids, at its rate, at the poses of the robot.
[[nodiscard]] DOPPEL_API std::unique_ptr<DeviceEmulator> emulated_devices(const ServoSetup& setup);

}  // namespace doppel
