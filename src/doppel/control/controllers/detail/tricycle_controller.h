#pragma once
// Drives a base with one wheel that is driven and steered, as of a forklift, from ~/cmd_vel
// (geometry_msgs/msg/TwistStamped). Compatible with ros2_controllers' tricycle_controller of ROS 2 Jazzy: it turns on
// the spot by steering to 90 degrees, drives slower until the angle is reached, and limits the speed of the wheel
// (rad/s) and the angle. ~/odom at each update, and odom -> base on /tf with enable_odom_tf; ~/reset_odometry
// (std_srvs/srv/Empty). It has no references for a chain.

#include <string>

#include "doppel/control/controllers/detail/odometry_publisher.h"
#include "doppel/control/controllers/detail/planar_odometry.h"
#include "doppel/control/controllers/detail/tricycle_limiter.h"
#include "doppel/control/controllers/detail/twist_command.h"
#include "doppel/control/manager/controller.h"
#include "doppel/ros/messages/ackermann_msgs.h"

namespace doppel {

class TricycleController : public Controller {
 public:
  void on_init(ControllerContext& context) override;
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override;
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override;
  Status on_configure() override;
  Status on_activate() override;
  Status on_deactivate() override;
  void update(Time now, Duration period) override;
  void housekeeping(Time now) override;
  [[nodiscard]] const BaseTransform* base_transform() const override { return publisher_.base_transform(); }

 private:
  struct WheelCommand {
    double angle = 0, speed = 0;  // rad, rad/s
  };
  void declare_wheel(ControllerContext& context);
  void declare_limits(ControllerContext& context);
  Status read_limits();
  // The wheel for a velocity of the base: m/s, rad/s.
  [[nodiscard]] WheelCommand wheel_for(double linear, double angular) const;

  ControllerContext* context_ = nullptr;
  std::string traction_, steering_;          // joints
  double wheelbase_ = 0, wheel_radius_ = 0;  // m
  bool open_loop_ = false, active_ = false;
  TractionLimits traction_limits_;
  SteeringLimits steering_limits_;
  LastTwo speeds_, angles_;
  PlanarOdometry odometry_;
  OdometryPublisher publisher_;
  TwistCommand command_;
  std::optional<Publisher<ackermann_msgs::msg::AckermannDrive>> ackermann_topic_;
  bool invalid_state_ = false, invalid_state_reported_ = false;
};

}  // namespace doppel
