#pragma once
// The joints of a simulated robot as the motors of emulated servos, by the setup of their driver: the
// machine is built as its setup says. What is built otherwise is a fault of the emulation
// (emulation/emulated_faults.h).

#include <memory>
#include <span>
#include <vector>

#include "doppel/control/hardware/nan.h"
#include "doppel/devices/drivers/servo_setup.h"
#include "doppel/devices/emulation/device_emulator.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

class DOPPEL_API EngineMotors {
 public:
  // strong_servos: each servo is as strong as the drive of its joint, whatever its model.
  EngineMotors(const ServoSetup& setup, Instance robot, bool strong_servos);

  // Before a step: what the joints have reached goes to the devices, and what these make of it to the
  // joints' drives.
  void step(DeviceEmulator& devices, Instance robot, Time now, Duration period);
  // In the loop: a hand holds the joints whose torque is off, and moves them to these positions (rad or m, by
  // the joints of the setup). NaN: it holds the joint where it is.
  void guide(std::span<const double> positions);
  // Between steps: it moves one joint there, also when the torque goes off only with the next step.
  void guide(std::size_t motor, double position);
  // Between steps: another compilation of the same joints, whose drives may be other ones.
  void rebind(Instance robot);
  // All joints are as without power.
  void release(Instance robot);

 private:
  struct Motor {
    JointServo servo;
    int joint = -1;
    ServoParameters as_compiled;
    bool strong = false;  // its whole torque is the effort limit of the joint's drive, which may be none
    bool on = false;
    // The hand's: its command, and the one that it does not follow, because it is from before the torque
    // went off.
    double command = kNaN, ignored = kNaN;
    bool held = false, fresh = false;  // fresh: commanded since the last step
  };
  void hold(Motor& motor, Instance robot) const;
  void apply(Motor& motor, const MotorDrive& drive, Instance robot);

  std::vector<Motor> motors_;
  std::vector<MotorState> states_;
  std::vector<MotorDrive> drives_;
  bool guided_ = false;
};

// The emulated devices of a setup: its servos with their ids, at its rate, at the poses of the robot.
[[nodiscard]] DOPPEL_API std::unique_ptr<DeviceEmulator> emulated_devices(const ServoSetup& setup,
                                                                          std::uint64_t seed = 1);

}  // namespace doppel
