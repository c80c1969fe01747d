#pragma once
// The drive of one joint: from a target to the spring and damper of each step (servo.h has the rules).

#include "doppel/base/core/time.h"
#include "doppel/physics/contract/detail/joint_spring.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

class Drive {
 public:
  // `carried` is the inertia that the joint carries; only an ideal servo needs it.
  Drive(int joint, const ServoParameters& servo, double carried, Duration step);

  [[nodiscard]] int joint() const { return joint_; }
  [[nodiscard]] DriveMode mode() const { return mode_; }
  [[nodiscard]] const ServoParameters& servo() const { return servo_; }
  void set_servo(const ServoParameters& servo);  // not ideal
  void start(DriveMode mode, double q);          // from where the joint is
  // kg m^2 or kg: what the motor adds to the joint's inertia in the present mode.
  [[nodiscard]] double rotor() const {
    return servo_.armature + (mode_ == DriveMode::effort ? servo_.rotor_inertia : 0.0);
  }
  void follow(double q);  // after the joint was moved by set_state: the reference follows it
  [[nodiscard]] DriveState state() const { return {mode_, target_, reference_}; }
  [[nodiscard]] double reference() const { return reference_; }
  void set_target(double target);  // a target that is not finite is ignored
  // Advances the reference by one step, which write_law() then describes. The joint is at q with velocity v.
  void advance(double q, double v);
  // The spring and damper during the step that advance() began. Sets all fields but the spring's joint, its
  // indices and its bound.
  void write_law(JointSpring& spring) const;

 private:
  [[nodiscard]] bool servoing() const { return mode_ == DriveMode::position || mode_ == DriveMode::velocity; }
  void write_effort(JointSpring& spring) const;
  void advance_share();
  double advance_position();
  void advance_velocity(double q, double v);

  int joint_;
  ServoParameters servo_;
  double step_;              // s
  double fastest_ = 0;       // rad or m: the largest move of the reference in one step
  double furthest_ = 0;      // rad or m: how far the reference may be ahead of the joint at a step's start
  std::int64_t stream_gap_;  // steps
  DriveMode mode_ = DriveMode::passive;
  double target_ = 0, reference_ = 0;
  double before_ = 0;              // the reference at the step's start
  double seen_ = 0;                // the part of the reference's velocity that enters the damper
  double spread_ = 0;              // rad or m: move in one step while a stream's target is approached
  double share_ = 0;               // of the reference's velocity that enters the damper
  std::int64_t spread_steps_ = 0;  // steps for which spread_ is used
  std::int64_t steps_since_target_ = 0;
};

}  // namespace doppel
