#pragma once
// Drives a base with steered wheels from ~/reference: bicycle (one driven, one steered wheel), tricycle (two
// driven, one steered) and Ackermann (two and two). Compatible with ros2_controllers' steering_controllers_library
// of ROS 2 Jazzy. Of two wheels the right one is listed first. The steering stays where it is without a reference.

#include <string>
#include <vector>

#include "doppel/control/controllers/detail/reference_base.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {

enum class SteeringKind { bicycle, tricycle, ackermann };

// The geometry, m.
struct SteeringGeometry {
  SteeringKind kind = SteeringKind::bicycle;
  double wheelbase = 0, radius = 0;               // radius: of the driven wheels
  double traction_track = 0, steering_track = 0;  // between the two driven, and the two steered wheels

  // The angle of a single steered wheel in the middle, for a velocity; 0 at rest.
  [[nodiscard]] double steering_for(double linear, double angular) const;
  // Of a driven wheel relative to the middle, at a steering angle; side: -1 right, 1 left.
  [[nodiscard]] double traction_factor(double steering, double side) const;
  // Of a steered wheel, for the angle in the middle, and the reverse.
  [[nodiscard]] double wheel_angle(double steering, double side) const;
  [[nodiscard]] double middle_angle(double wheel, double side) const;
};

class SteeringController : public ReferenceBase {
 public:
  explicit SteeringController(SteeringKind kind) { geometry_.kind = kind; }
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

 private:
  using Names = std::vector<std::string>;
  void declare_joints(ControllerContext& context);
  // The value of `parameter`, or of one of its deprecated names, which are reported.
  Names declare_names(ControllerContext& context, const std::string& parameter, const std::string& deprecated,
                      std::size_t expected);
  double declare_length(ControllerContext& context, const std::string& parameter,
                        const std::vector<std::string>& deprecated, bool required);
  void declare_geometry(ControllerContext& context);
  [[nodiscard]] std::size_t driven() const { return geometry_.kind == SteeringKind::bicycle ? 1 : 2; }
  [[nodiscard]] std::size_t steered() const { return geometry_.kind == SteeringKind::ackermann ? 2 : 1; }

  SteeringGeometry geometry_;
  Names traction_, steering_, traction_states_, steering_states_;  // joints
  bool front_steering_ = true, open_loop_ = false, position_feedback_ = false, waits_for_steering_ = false;
  double steering_angle_ = 0;  // rad, measured, in the middle
  std::vector<double> last_;   // rad, of the driven wheels at the last update; NaN: none
  Publisher<control_msgs::msg::SteeringControllerStatus> state_topic_;
  control_msgs::msg::SteeringControllerStatus state_;
};

}  // namespace doppel
