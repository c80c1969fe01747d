#pragma once
// Drives a base with four mecanum wheels from ~/reference. Compatible with ros2_controllers'
// mecanum_drive_controller of ROS 2 Jazzy. Order of the wheels: front left, front right, rear right, rear left.

#include <array>
#include <string>
#include <vector>

#include "doppel/control/controllers/detail/reference_base.h"
#include "doppel/control/controllers/detail/speed_limiter.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {

class MecanumDriveController : public ReferenceBase {
 public:
  void on_init(ControllerContext& context) override;
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override;
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override;
  Status on_configure() override;
  [[nodiscard]] std::vector<std::string> reference_interfaces() const override;

 protected:
  [[nodiscard]] std::optional<PlanarVelocity> reference() const override;
  void write_reference(const geometry_msgs::msg::Twist& twist) override;
  void measure(const std::optional<PlanarVelocity>& reference, double dt) override;
  void command(const PlanarVelocity& reference, double dt) override;
  void stop_wheels() override;
  void publish_state(Time now) override;
  void rest() override;

 private:
  void declare_wheels(ControllerContext& context);

  std::array<std::string, 4> commanded_, measured_;  // joints
  double radius_ = 0, reach_ = 0;         // m; reach: sum of the distances along x and y to a wheel
  PlanarPose offset_;                     // of the base's frame in that of the wheels' centre
  std::array<SpeedLimiter, 3> limiters_;  // x, y, yaw
  Publisher<control_msgs::msg::MecanumDriveControllerState> state_topic_;
  control_msgs::msg::MecanumDriveControllerState state_;
};

}  // namespace doppel
