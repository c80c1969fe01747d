#include "doppel/sensors/models/lens.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace doppel {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

// Coordinates before K.
Vector2d distorted(const CameraIntrinsics& camera, const Vector2d& x) {
  const auto& [k1, k2, p1, p2, k3] = camera.d;
  const double r2 = x.squaredNorm(), radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return x * radial + Vector2d(2 * p1 * x.x() * x.y() + p2 * (r2 + 2 * x.x() * x.x()),
                               p1 * (r2 + 2 * x.y() * x.y()) + 2 * p2 * x.x() * x.y());
}

double distorted_angle(const CameraIntrinsics& camera, double theta) {
  const double t2 = theta * theta;
  return theta * (1 + t2 * (camera.d[0] + t2 * (camera.d[1] + t2 * (camera.d[2] + t2 * camera.d[3]))));
}

// The radius up to which distortion grows with the distance from the axis: beyond it two directions have one pixel.
double growing_radius(const CameraIntrinsics& camera) {
  const auto& [k1, k2, p1, p2, k3] = camera.d;
  for (int i = 0; i < 2000; ++i) {
    const double r = 0.005 * i;
    const double r2 = r * r;
    if (1 + r2 * (3 * k1 + r2 * (5 * k2 + r2 * 7 * k3)) <= 0) return r;
  }
  return 10;
}

// The derivative of distorted().
Eigen::Matrix2d distortion_slope(const CameraIntrinsics& camera, const Vector2d& x) {
  const auto& [k1, k2, p1, p2, k3] = camera.d;
  const double r2 = x.squaredNorm(), radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3)),
               slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3));  // d radial / d x = slope x
  Eigen::Matrix2d J;
  J << radial + slope * x.x() * x.x() + 2 * p1 * x.y() + 6 * p2 * x.x(),
      slope * x.x() * x.y() + 2 * p1 * x.x() + 2 * p2 * x.y(),
      slope * x.x() * x.y() + 2 * p1 * x.x() + 2 * p2 * x.y(),
      radial + slope * x.y() * x.y() + 6 * p1 * x.y() + 2 * p2 * x.x();
  return J;
}

// An upper limit of |distorted(x)| over |x| <= most, within which it grows.
double largest_distorted(const CameraIntrinsics& camera, double most) {
  const double r2 = most * most, radial = 1 + r2 * (camera.d[0] + r2 * (camera.d[1] + r2 * camera.d[4]));
  return most * radial + 3 * (std::abs(camera.d[2]) + std::abs(camera.d[3])) * r2;
}

// `start`: from where Newton's method begins, such as the solution of the pixel beside.
std::optional<Vector2d> undistorted(const CameraIntrinsics& camera, const Vector2d& seen, double most,
                                    const Vector2d& start) {
  if (seen.norm() > largest_distorted(camera, most) * (1 + 1e-9)) return std::nullopt;
  Vector2d x = start;
  if (x.norm() > most) x *= 0.9 * most / x.norm();
  for (int i = 0; i < 60; ++i) {
    const Vector2d error = distorted(camera, x) - seen;
    if (error.norm() < 1e-12) return x.norm() <= most ? std::optional(x) : std::nullopt;
    const Eigen::Matrix2d J = distortion_slope(camera, x);
    if (std::abs(J.determinant()) < 1e-9) return std::nullopt;
    Vector2d step = J.inverse() * error;
    if (step.norm() > 0.3) step *= 0.3 / step.norm();
    x -= step;
  }
  return (distorted(camera, x) - seen).norm() < 1e-9 && x.norm() <= most ? std::optional(x) : std::nullopt;
}

std::optional<double> angle_of(const CameraIntrinsics& camera, double seen) {
  double theta = std::min(seen, kPi);
  for (int i = 0; i < 60; ++i) {
    const double error = distorted_angle(camera, theta) - seen;
    if (std::abs(error) < 1e-13) return theta;
    const double slope =
        (distorted_angle(camera, theta + 1e-6) - distorted_angle(camera, theta - 1e-6)) / 2e-6;
    if (slope < 1e-6) return std::nullopt;
    theta -= std::clamp(error / slope, -0.3, 0.3);
    if (theta < 0) theta = 0;
  }
  return std::abs(distorted_angle(camera, theta) - seen) < 1e-9 ? std::optional(theta) : std::nullopt;
}

// `near`, if given: the direction of a pixel beside, with z 1.
std::optional<Vector3d> direction_at(const CameraIntrinsics& camera, double u, double v, double most,
                                     const std::optional<Vector3d>& near = {}) {
  const double y = (v - camera.cy) / camera.fy, x = (u - camera.cx - camera.skew * y) / camera.fx;
  if (camera.model == Distortion::equidistant) {
    const double seen = std::hypot(x, y);
    const std::optional<double> theta = angle_of(camera, seen);
    if (!theta || *theta > camera.cutoff) return std::nullopt;
    if (seen == 0) return Vector3d(0, 0, 1);
    const double s = std::sin(*theta) / seen;
    return Vector3d(s * x, s * y, std::cos(*theta));
  }
  std::optional<Vector2d> at = Vector2d(x, y);
  if (!camera.plain()) at = undistorted(camera, *at, most, near ? Vector2d(near->head<2>()) : *at);
  if (!at || std::atan(at->norm()) > camera.cutoff) return std::nullopt;
  return Vector3d(at->x(), at->y(), 1);
}

double halton(int index, int base) {
  double part = 1, value = 0;
  for (; index > 0; index /= base) {
    part /= base;
    value += part * (index % base);
  }
  return value;
}

}  // namespace

std::optional<Vector2d> project(const CameraIntrinsics& camera, const Vector3d& p_C) {
  const double theta = std::atan2(p_C.head<2>().norm(), p_C.z());
  if (theta > camera.cutoff) return std::nullopt;
  Vector2d x = Vector2d::Zero();
  if (camera.model == Distortion::equidistant) {
    if (theta > 0) x = p_C.head<2>().normalized() * distorted_angle(camera, theta);
  } else {
    if (p_C.z() <= 0) return std::nullopt;
    x = distorted(camera, p_C.head<2>() / p_C.z());
  }
  return Vector2d(camera.fx * x.x() + camera.skew * x.y() + camera.cx, camera.fy * x.y() + camera.cy);
}

double largest_radius(const CameraIntrinsics& camera) {
  return camera.model == Distortion::plumb_bob && !camera.plain() ? growing_radius(camera)
                                                                  : std::numeric_limits<double>::infinity();
}

std::optional<Vector3d> direction_at(const CameraIntrinsics& camera, double u, double v) {
  return direction_at(camera, u, v, growing_radius(camera));
}

std::vector<PixelRays> pixel_rays(const CameraIntrinsics& camera, int samples) {
  const double most = growing_radius(camera);
  std::vector<PixelRays> out;
  for (int s = 0; s < std::max(1, samples); ++s) {
    const double du = s == 0 ? 0 : halton(s, 2) - 0.5, dv = s == 0 ? 0 : halton(s, 3) - 0.5;
    PixelRays rays;
    rays.width = camera.width;
    rays.height = camera.height;
    rays.planar = camera.model == Distortion::plumb_bob;
    rays.pixel_angle = static_cast<float>(1 / camera.fx);
    const auto pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    for (std::vector<float>* values : {&rays.x, &rays.y, &rays.z}) values->reserve(pixels);
    for (int v = 0; v < camera.height; ++v) {
      std::optional<Vector3d> found;
      for (int u = 0; u < camera.width; ++u) {
        found = direction_at(camera, u + du, v + dv, most, found);
        const Vector3d d = found.value_or(Vector3d::Zero());
        rays.x.push_back(static_cast<float>(d.x()));
        rays.y.push_back(static_cast<float>(d.y()));
        rays.z.push_back(static_cast<float>(d.z()));
      }
    }
    out.push_back(std::move(rays));
  }
  return out;
}

}  // namespace doppel
