#pragma once
// Drives a base on three or more omni wheels, evenly spaced on a circle with their axles to its centre, from
// ~/cmd_vel. Compatible with ros2_controllers' omni_wheel_drive_controller of ROS 2 Jazzy and later: wheels
// anti-clockwise, the first one at `wheel_offset` from the base's x axis; a wheel that turns by the right hand about
// the outward axle drives the base to the right, seen from the centre. There are no limits.
// ~/set_odometry (control_msgs/srv/SetOdometry) is that of later releases.

#include <string>
#include <vector>

#include "doppel/control/controllers/detail/velocity_base.h"

namespace doppel {

class OmniWheelDriveController : public VelocityBase {
 public:
  void on_init(ControllerContext& context) override;
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override;
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override;
  Status on_configure() override;
  [[nodiscard]] std::vector<std::string> reference_interfaces() const override;

 protected:
  void write_references(const geometry_msgs::msg::Twist& twist) override;
  PlanarVelocity next_velocity(double dt) override;
  bool measure(double dt) override;
  void drive(const PlanarVelocity& velocity) override;

 private:
  // The position of a wheel on the circle.
  struct Wheel {
    double sine = 0, cosine = 0;
    double last = 0;  // rad, at the last update; NaN: none since it was configured
  };

  std::vector<std::string> joints_;
  std::vector<Wheel> wheels_;
  double robot_radius_ = 0, wheel_radius_ = 0;  // m
  bool open_loop_ = false, position_feedback_ = true;
};

}  // namespace doppel
