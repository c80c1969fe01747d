#pragma once
// Drives a base with wheels on two sides from ~/cmd_vel (geometry_msgs/msg/TwistStamped), or from the
// controller before it in a chain: limited velocities to the wheels, odometry from them. Compatible with
// ros2_controllers' diff_drive_controller of ROS 2 Jazzy; ~/set_odometry (control_msgs/srv/SetOdometry) is that
// of later releases.

#include <optional>
#include <string>
#include <vector>

#include "doppel/control/controllers/detail/diff_drive_settings.h"
#include "doppel/control/controllers/detail/speed_limiter.h"
#include "doppel/control/controllers/detail/velocity_base.h"

namespace doppel {

class DiffDriveController : public VelocityBase {
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
  void publish_limited(Time now, const PlanarVelocity& velocity) override;
  void rest() override;

 private:
  [[nodiscard]] std::optional<double> mean_of_side(std::size_t first) const;

  DiffDriveSettings settings_;
  SpeedLimiter linear_limiter_, angular_limiter_;
  std::optional<Publisher<geometry_msgs::msg::TwistStamped>> limited_topic_;
  geometry_msgs::msg::TwistStamped limited_;
  // Of each side at the last update, rad; NaN: none since it was configured.
  double last_left_ = 0, last_right_ = 0;
};

}  // namespace doppel
