#include "doppel/devices/emulated_robot/engine_motors.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "doppel/control/hardware/nan.h"
#include "doppel/devices/emulation/board_emulator.h"
#include "doppel/devices/emulation/bus_emulator.h"

namespace doppel {
namespace {

// A hobby servo is somewhat faster than its joint may be, and its torque is that of the joint.
std::unique_ptr<DeviceEmulator> emulated_board(const ServoSetup& setup, std::uint64_t seed) {
  constexpr double kFaster = 1.3;
  std::vector<HobbyServo> servos;
  for (const JointServo& one : setup.joints)
    servos.push_back({one.id, one.pulse_min, one.pulse_max, one.travel, kFaster * one.velocity * one.scale,
                      one.effort / one.scale});
  return std::make_unique<BoardEmulator>(std::move(servos), std::vector<EmulatedFault>{}, seed);
}

}  // namespace

EngineMotors::EngineMotors(const ServoSetup& setup, Instance robot, bool strong_servos) {
  for (const JointServo& servo : setup.joints) {
    Motor motor;
    motor.servo = servo;
    // The motor turns what is in front of the homing offset.
    if (servo.recorded) motor.servo.offset += servo.recorded->homing_offset * servo.model->tick_angle();
    motor.joint = robot.model().find_joint(servo.joint);
    motor.as_compiled = robot.made_of().servos[static_cast<std::size_t>(motor.joint)];
    motor.strong = strong_servos && servo.model != nullptr;
    motors_.push_back(std::move(motor));
  }
  states_.resize(motors_.size());
  drives_.resize(motors_.size());
}

void EngineMotors::apply(Motor& motor, const MotorDrive& drive, Instance robot) {
  // A reload replaces the engine, and with it the drives.
  const bool driven = robot.drive(motor.joint) == DriveMode::position;
  if (drive.on != motor.on || (drive.on && !driven)) {
    robot.set_drive(motor.joint, drive.on ? DriveMode::position : DriveMode::passive);
    motor.on = drive.on;
    motor.held = false;
  }
  if (!drive.on) {
    if (guided_) hold(motor, robot);
    motor.fresh = false;
    return;
  }
  motor.fresh = false;
  ServoParameters servo = motor.as_compiled;
  servo.stiffness *= drive.gain;
  if (!motor.strong) {
    servo.effort = std::min(servo.effort, drive.effort * motor.servo.scale);
  } else if (const double share = drive.effort / motor.servo.model->stall_torque; share < 1) {
    servo.effort = share > 0 ? servo.effort * share : 0;
  }
  servo.velocity = std::min(servo.velocity, drive.velocity / motor.servo.scale);
  robot.set_servo(motor.joint, servo);
  robot.set_target(motor.joint, motor.servo.joint_position(drive.goal));
}

void EngineMotors::guide(std::span<const double> positions) {
  guided_ = true;
  for (std::size_t i = 0; i < motors_.size(); ++i) motors_[i].command = positions[i];
}

void EngineMotors::guide(std::size_t motor, double position) {
  guided_ = true;
  motors_[motor].command = position;
  motors_[motor].ignored = kNaN;
  motors_[motor].fresh = true;
}

void EngineMotors::rebind(Instance robot) {
  for (Motor& motor : motors_)
    motor.as_compiled = robot.made_of().servos[static_cast<std::size_t>(motor.joint)];
}

void EngineMotors::hold(Motor& motor, Instance robot) const {
  if (!motor.held || robot.drive(motor.joint) != DriveMode::position) {
    const ModelJoint& joint = robot.model().joints[static_cast<std::size_t>(motor.joint)];
    robot.set_servo(motor.joint, motor.as_compiled);
    robot.set_drive(motor.joint, DriveMode::position);
    robot.set_target(motor.joint, robot.q()[static_cast<std::size_t>(joint.q)]);
    // The hand of before a reload continues.
    if (!motor.held && !motor.fresh) motor.ignored = motor.command;
    motor.held = true;
  }
  if (!std::isfinite(motor.command) || motor.command == motor.ignored) return;
  motor.ignored = kNaN;
  robot.set_target(motor.joint, motor.command);
}

void EngineMotors::step(DeviceEmulator& devices, Instance robot, Time now, Duration period) {
  const Model& model = robot.model();
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    const JointServo& servo = motors_[i].servo;
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(motors_[i].joint)];
    const double rate = servo.direction * servo.scale;
    states_[i].position = servo.shaft(robot.q()[static_cast<std::size_t>(joint.q)]);
    states_[i].velocity = rate * robot.v()[static_cast<std::size_t>(joint.v)];
    const double effort = robot.drive_effort()[static_cast<std::size_t>(motors_[i].joint)];
    const double most = motors_[i].as_compiled.effort;
    states_[i].effort =
        motors_[i].strong ? servo.direction * effort / most * servo.model->stall_torque : effort / rate;
  }
  devices.step(now, period, states_, drives_);
  for (std::size_t i = 0; i < motors_.size(); ++i) apply(motors_[i], drives_[i], robot);
}

void EngineMotors::release(Instance robot) {
  for (Motor& motor : motors_) {
    robot.set_drive(motor.joint, DriveMode::passive);
    robot.set_servo(motor.joint, motor.as_compiled);
    motor.on = motor.held = false;
  }
}

std::unique_ptr<DeviceEmulator> emulated_devices(const ServoSetup& setup, std::uint64_t seed) {
  if (setup.protocol == ServoProtocol::servo_line) return emulated_board(setup, seed);
  std::vector<RegisterServo> servos;
  for (const JointServo& one : setup.joints) {
    RegisterServo servo(*one.model, one.id);
    for (const auto& [index, rate] : one.model->baud_rates) {
      if (rate == setup.rate) servo.set(ServoRole::baud_rate, index);
    }
    servo.set(ServoRole::return_delay, 0);
    if (one.recorded) {
      servo.set(ServoRole::homing_offset, one.recorded->homing_offset);
      servo.set(ServoRole::min_position, one.recorded->range_min);
      servo.set(ServoRole::max_position, one.recorded->range_max);
    }
    servos.push_back(std::move(servo));
  }
  return std::make_unique<BusEmulator>(setup.protocol, std::move(servos), std::vector<EmulatedFault>{}, seed);
}

}  // namespace doppel
