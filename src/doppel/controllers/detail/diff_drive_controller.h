#pragma once
// Drives a base with wheels on two sides from ~/cmd_vel (geometry_msgs/msg/TwistStamped), or from the
// controller before it in a chain: limited velocities to the wheels, odometry from them. Compatible with
// ros2_controllers' diff_drive_controller of ROS 2 Jazzy; ~/set_odometry (control_msgs/srv/SetOdometry) is that
// of later releases.

#include <optional>
#include <string>
#include <vector>

#include "doppel/control/controller.h"
#include "doppel/controllers/detail/diff_drive_settings.h"
#include "doppel/controllers/detail/odometry_publisher.h"
#include "doppel/controllers/detail/planar_odometry.h"
#include "doppel/controllers/detail/speed_limiter.h"
#include "doppel/controllers/detail/twist_command.h"

namespace doppel {

class DiffDriveController : public Controller {
 public:
  void on_init(ControllerContext& context) override;
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override;
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override;
  Status on_configure() override;
  Status on_activate() override;
  Status on_deactivate() override;
  void update(Time now, Duration period) override;
  void housekeeping(Time now) override;
  [[nodiscard]] std::vector<std::string> reference_interfaces() const override;
  void set_chained_mode(bool chained) override;
  [[nodiscard]] const BaseTransform* base_transform() const override { return publisher_.base_transform(); }

 private:
  void take_references(Time now);
  // False: a state is not a number.
  bool measure(double dt);
  [[nodiscard]] std::optional<double> mean_of_side(std::size_t first) const;
  void drive(double linear, double angular);
  void publish_limited(Time now, double linear, double angular);
  void rest();

  ControllerContext* context_ = nullptr;
  DiffDriveSettings settings_;
  SpeedLimiter linear_limiter_, angular_limiter_;
  PlanarOdometry odometry_;
  OdometryPublisher publisher_;
  TwistCommand command_;
  std::optional<Publisher<geometry_msgs::msg::TwistStamped>> limited_topic_;
  geometry_msgs::msg::TwistStamped limited_;
  // Of each side at the last update, rad; NaN: none since it was configured.
  double last_left_ = 0, last_right_ = 0;
  bool active_ = false, chained_ = false;
  bool invalid_state_ = false, invalid_state_reported_ = false;
};

}  // namespace doppel
