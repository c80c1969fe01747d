#pragma once
// The pose of a base in the plane, integrated from the velocities that its encoders or commands give, and the
// velocity as a mean of the last ones, as in ros2_controllers. Metres, radians, seconds.

#include <cstddef>
#include <vector>

namespace doppel {

struct OdometryPose {
  double x = 0, y = 0, yaw = 0;
};

// Of the base, along the axes of its own frame: x ahead, y to the left.
struct PlanarVelocity {
  double x = 0, y = 0, yaw = 0;
};

class PlanarOdometry {
 public:
  // The number of velocities in the mean, at least one; forgets those so far. Allocates.
  void set_window(std::size_t velocities);
  void reset(const OdometryPose& pose = {});  // forgets the velocities, too
  // The base has moved at the constant velocity for dt: along a circular arc.
  void move(const PlanarVelocity& velocity, double dt);
  // The same, where the velocity is known and needs no mean (open loop).
  void move_exactly(const PlanarVelocity& velocity, double dt);

  [[nodiscard]] const OdometryPose& pose() const { return pose_; }
  [[nodiscard]] const PlanarVelocity& velocity() const { return velocity_; }

 private:
  void integrate(const PlanarVelocity& velocity, double dt);

  OdometryPose pose_;
  PlanarVelocity velocity_;
  std::vector<PlanarVelocity> window_;  // a ring
  std::size_t next_ = 0, filled_ = 0;
};

}  // namespace doppel
