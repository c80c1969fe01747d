#include "doppel/control/controllers/detail/planar_odometry.h"

#include <algorithm>
#include <cmath>

namespace doppel {

void PlanarOdometry::set_window(std::size_t velocities) {
  window_.assign(std::max<std::size_t>(velocities, 1), PlanarVelocity{});
  next_ = filled_ = 0;
}

void PlanarOdometry::reset(const OdometryPose& pose) {
  pose_ = pose;
  velocity_ = {};
  next_ = filled_ = 0;
}

void PlanarOdometry::integrate(const PlanarVelocity& velocity, double dt) {
  constexpr double kStraight = 1e-6;  // rad; below it the radius of the arc loses its digits
  const double turn = velocity.yaw * dt;
  double ahead = dt, aside = dt * turn / 2;  // the displacement for a unit velocity ahead
  if (std::abs(turn) >= kStraight) {
    ahead = std::sin(turn) / velocity.yaw;
    aside = (1 - std::cos(turn)) / velocity.yaw;
  }
  const double dx = velocity.x * ahead - velocity.y * aside, dy = velocity.x * aside + velocity.y * ahead;
  const double c = std::cos(pose_.yaw), s = std::sin(pose_.yaw);
  pose_.x += c * dx - s * dy;
  pose_.y += s * dx + c * dy;
  pose_.yaw += turn;
}

void PlanarOdometry::move(const PlanarVelocity& velocity, double dt) {
  integrate(velocity, dt);
  window_[next_] = velocity;
  next_ = (next_ + 1) % window_.size();
  filled_ = std::min(filled_ + 1, window_.size());
  PlanarVelocity sum;
  for (std::size_t i = 0; i < filled_; ++i) {
    sum.x += window_[i].x;
    sum.y += window_[i].y;
    sum.yaw += window_[i].yaw;
  }
  const double n = static_cast<double>(filled_);
  velocity_ = {sum.x / n, sum.y / n, sum.yaw / n};
}

void PlanarOdometry::move_exactly(const PlanarVelocity& velocity, double dt) {
  integrate(velocity, dt);
  velocity_ = velocity;
}

}  // namespace doppel
