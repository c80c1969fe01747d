#pragma once
// The drive of one joint: from a target to the control of its actuator, step by step (servo.h tells the
// rules).

#include "doppel/core/time.h"
#include "doppel/physics/engine.h"

namespace doppel {

class Drive {
 public:
  // `carried` is the inertia that the joint carries; only an ideal servo needs it.
  Drive(int joint, const ServoParameters& servo, double carried, Duration step);

  [[nodiscard]] int joint() const { return joint_; }
  [[nodiscard]] DriveMode mode() const { return mode_; }
  [[nodiscard]] const ServoParameters& servo() const { return servo_; }
  // The spring and the damper of the actuator in the current mode, and the factor of its control.
  [[nodiscard]] double stiffness() const { return servoing() ? servo_.stiffness : 0.0; }
  [[nodiscard]] double damping() const { return servoing() ? servo_.damping : 0.0; }
  [[nodiscard]] double gain() const {
    return servoing() ? servo_.stiffness : mode_ == DriveMode::effort ? 1.0 : 0.0;
  }

  void start(DriveMode mode, double q);  // from where the joint is
  void follow(double q);                 // the joint was put elsewhere: the reference goes with it
  [[nodiscard]] double reference() const { return reference_; }
  [[nodiscard]] double target() const { return target_; }
  void set_target(double target);  // a target that is not finite is ignored
  // Advances the reference by one step and returns the actuator's control: gain * control - stiffness * q -
  // damping * v is the drive's effort before it is clipped.
  double advance(double q);

 private:
  [[nodiscard]] bool servoing() const { return mode_ == DriveMode::position || mode_ == DriveMode::velocity; }
  double advance_position();

  int joint_;
  ServoParameters servo_;
  double step_;              // s
  double fastest_;           // the reference's longest way in one step
  double furthest_;          // that the reference runs ahead of the joint
  double damping_time_;      // damping / stiffness, s
  std::int64_t stream_gap_;  // steps
  DriveMode mode_ = DriveMode::limp;
  double target_ = 0, reference_ = 0;
  double spread_ = 0;              // way in one step while a stream's target is approached
  std::int64_t spread_steps_ = 0;  // how long spread_ counts
  std::int64_t steps_since_target_ = 0;
};

}  // namespace doppel
