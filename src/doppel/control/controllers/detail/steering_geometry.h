#pragma once
// The geometry of bases with steered wheels: bicycle (one driven, one steered wheel), tricycle (two driven,
// one steered) and Ackermann (two and two).

#include <cstddef>

namespace doppel {

enum class SteeringKind { bicycle, tricycle, ackermann };

// Lengths in m.
struct SteeringGeometry {
  SteeringKind kind = SteeringKind::bicycle;
  double wheelbase = 0, radius = 0;               // radius: of the driven wheels
  double traction_track = 0, steering_track = 0;  // between the two driven, and the two steered wheels

  [[nodiscard]] std::size_t driven() const { return kind == SteeringKind::bicycle ? 1 : 2; }
  [[nodiscard]] std::size_t steered() const { return kind == SteeringKind::ackermann ? 2 : 1; }
  // The angle of a single steered wheel in the middle, for a velocity; 0 at rest.
  [[nodiscard]] double steering_for(double linear, double angular) const;
  // The speed of a driven wheel relative to the middle, at a steering angle; side: -1 right, 1 left.
  [[nodiscard]] double traction_factor(double steering, double side) const;
  // The angle of a steered wheel for the angle in the middle, and the reverse.
  [[nodiscard]] double wheel_angle(double steering, double side) const;
  [[nodiscard]] double middle_angle(double wheel, double side) const;
};

}  // namespace doppel
