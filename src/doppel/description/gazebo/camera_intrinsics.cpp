#include "doppel/description/gazebo/camera_intrinsics.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace doppel {
namespace {

constexpr double kPi = std::numbers::pi;

// g(theta) of r = f g(theta).
double lens_curve(const LensDescription& lens, double theta) {
  switch (lens.kind) {
    case LensKind::pinhole:
      return std::tan(theta);
    case LensKind::stereographic:
      return 2 * std::tan(theta / 2);
    case LensKind::equidistant:
      return theta;
    case LensKind::equisolid:
      return 2 * std::sin(theta / 2);
    case LensKind::orthographic:
      return std::sin(theta);
    case LensKind::custom:
      break;
  }
  const double x = theta / lens.c2 + lens.c3;
  const double value = lens.function == "sin" ? std::sin(x) : lens.function == "id" ? x : std::tan(x);
  return lens.c1 * value;
}

// r = f theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8), by least squares up to `most`.
void fit_equidistant(const LensDescription& lens, double f, double most, CameraIntrinsics& out,
                     double* deviation) {
  constexpr int kPoints = 400;
  Eigen::MatrixXd powers(kPoints, 5);
  Eigen::VectorXd radii(kPoints);
  for (int i = 0; i < kPoints; ++i) {
    const double theta = most * (i + 1) / kPoints;
    for (int k = 0; k < 5; ++k) powers(i, k) = std::pow(theta, 2 * k + 1);
    radii[i] = f * lens_curve(lens, theta);
  }
  const Eigen::VectorXd fitted = powers.colPivHouseholderQr().solve(radii);
  out.fx = out.fy = fitted[0];
  for (int k = 0; k < 4; ++k) out.d[static_cast<std::size_t>(k)] = fitted[k + 1] / fitted[0];
  if (deviation != nullptr) *deviation = (powers * fitted - radii).cwiseAbs().maxCoeff();
}

}  // namespace

CameraIntrinsics intrinsics_of(const CameraDescription& camera, double* deviation) {
  if (deviation != nullptr) *deviation = 0;
  CameraIntrinsics out;
  out.width = camera.width;
  out.height = camera.height;
  out.cx = (camera.width - 1) / 2.0;
  out.cy = (camera.height - 1) / 2.0;
  const LensDescription& lens = camera.lens;
  if (lens.kind == LensKind::pinhole) {
    out.fx = out.fy = camera.width / (2 * std::tan(camera.hfov / 2));
    out.d = lens.distortion;
  } else {
    const double half = camera.hfov / 2;
    const double f = lens.scale_to_hfov || lens.kind != LensKind::custom
                         ? camera.width / 2.0 / lens_curve(lens, half)
                         : lens.f * camera.width / 2.0;
    out.model = Distortion::equidistant;
    out.cutoff = std::min(lens.cutoff_angle, kPi);
    const double corner = half * std::hypot(camera.width, camera.height) / camera.width;
    double most = std::min({out.cutoff, corner, kPi});
    if (lens.kind == LensKind::orthographic) most = std::min(most, 0.98 * kPi / 2);
    fit_equidistant(lens, f, most, out, deviation);
    out.cutoff = most;
  }
  if (lens.intrinsics) {
    out.fx = lens.intrinsics->fx;
    out.fy = lens.intrinsics->fy;
    out.cx = lens.intrinsics->cx;
    out.cy = lens.intrinsics->cy;
    out.skew = lens.intrinsics->s;
  }
  return out;
}

}  // namespace doppel
