#pragma once
// One joint that moves slowly with little torque, while all other servos keep the torque that they have.

#include <functional>
#include <string>
#include <vector>

#include "doppel/devices/buses/servo_bus.h"
#include "doppel/devices/drivers/servo_setup.h"

namespace doppel {

class SlowJoint {
 public:
  // torque: of the stall torque. ends(): true: the motion ends where it is; may be empty. All outlive it.
  SlowJoint(ServoBus& bus, const ServoSetup& setup, const JointServo& servo, double torque,
            const std::function<bool()>& ends);

  // Reads all servos. Throws InputError: this one does not answer.
  void read();
  // The joints whose servos have not answered the last read().
  [[nodiscard]] std::vector<const JointServo*> silent() const;
  // The torque goes on with the goal at q (rad). False: the servo does not accept the goal. Throws
  // InputError: it does not answer; a torque that was off before is then switched off again.
  [[nodiscard]] bool torque_on(double q);
  // The torque and its limit become those from before torque_on(). Throws InputError, when both were sent:
  // the servo has not confirmed them.
  void torque_back();
  // rad/s of the joint, on the servo's own way to a goal; 0: the fastest.
  void set_speed(double speed);
  [[nodiscard]] bool write_goal(double q);
  // In small steps, at rest at both ends.
  void move(double start, double goal, double seconds);

  [[nodiscard]] double position(std::size_t joint) const;
  [[nodiscard]] double position() const { return position(index_); }
  [[nodiscard]] double peak_load() const { return peak_; }
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  [[noreturn]] void refuse() const;
  [[nodiscard]] const ServoRegister& which(ServoRole role) const { return *servo_.model->find(role); }
  std::int64_t read(ServoRole role);
  void write(ServoRole role, std::int64_t value);

  ServoBus& bus_;
  const ServoSetup& setup_;
  const JointServo& servo_;
  const double torque_;
  const std::function<bool()>& ends_;
  std::vector<BusServo> servos_;
  std::vector<ServoReading> readings_;
  std::vector<bool> answered_;  // by the joints of the setup, the last read()
  std::size_t index_ = 0;
  bool was_on_ = false, ended_ = false;
  std::int64_t limit_ = 0;
  double peak_ = 0;
};

}  // namespace doppel
