#pragma once
// The common parts of the controllers of bases with ~/cmd_vel (geometry_msgs/msg/TwistStamped): those of two
// sides of wheels and of omni wheels in ros2_controllers. A command holds for cmd_vel_timeout, then the
// references are zero. Until the first command, or the end of the time-out, they are NaN and there is no odometry.

#include "doppel/control/controllers/detail/odometry_publisher.h"
#include "doppel/control/controllers/detail/planar_odometry.h"
#include "doppel/control/controllers/detail/twist_command.h"
#include "doppel/control/manager/controller.h"

namespace doppel {

class VelocityBase : public Controller {
 public:
  Status on_activate() override;
  Status on_deactivate() override;
  void update(Time now, Duration period) final;
  void housekeeping(Time now) override;
  void set_chained_mode(bool chained) override;
  [[nodiscard]] const BaseTransform* base_transform() const override { return publisher_.base_transform(); }

 protected:
  // The odometry's parameters, its topics, ~/set_odometry, and the topic of commands: Twist on
  // ~/cmd_vel_unstamped where they have no stamps.
  void declare_velocity_base(ControllerContext& context, const OdometryPublisher::Options& odometry,
                             bool stamped);
  struct Configuration {
    Duration timeout{};      // zero: never
    std::size_t window = 1;  // velocities in the mean of the odometry
    bool open_loop = false;  // odometry from the commands
  };
  Status configure_velocity_base(const Configuration& configuration);

  // In the loop.
  // Into reference_handles, unless a component that the base uses is not a number.
  virtual void write_references(const geometry_msgs::msg::Twist& twist) = 0;
  // The velocity to drive at now, from references that are numbers.
  virtual PlanarVelocity next_velocity(double dt) = 0;
  virtual bool measure(double dt) = 0;  // false: a state is not a number
  virtual void drive(const PlanarVelocity& velocity) = 0;
  virtual void publish_limited(Time /*now*/, const PlanarVelocity& /*velocity*/) {}
  virtual void rest() {}  // forgets the history of limiters

  ControllerContext* context_ = nullptr;
  PlanarOdometry odometry_;

 private:
  void forget();
  void take_references(Time now);

  OdometryPublisher publisher_;
  TwistCommand command_;
  bool active_ = false, chained_ = false, open_loop_ = false;
  bool invalid_state_ = false, invalid_state_reported_ = false;
};

}  // namespace doppel
