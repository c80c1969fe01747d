#include "doppel/sensors/models/coverage.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "doppel/sensors/models/lens.h"

namespace doppel {

std::vector<SightLine> sight_lines(const RayCaster& caster, const Eigen::Vector3d& eye_W,
                                   std::span<const Eigen::Vector3d> points_W) {
  RayBatch rays;
  rays.resize(points_W.size(), 1);
  rays.origin_x[0] = static_cast<float>(eye_W.x());
  rays.origin_y[0] = static_cast<float>(eye_W.y());
  rays.origin_z[0] = static_cast<float>(eye_W.z());
  double farthest = 0;
  std::vector<double> distances(points_W.size());
  for (std::size_t i = 0; i < points_W.size(); ++i) {
    const Eigen::Vector3d way = points_W[i] - eye_W;
    distances[i] = way.norm();
    farthest = std::max(farthest, distances[i]);
    const Eigen::Vector3d direction = distances[i] > 0 ? Eigen::Vector3d(way / distances[i]) : way;
    rays.direction_x[i] = static_cast<float>(direction.x());
    rays.direction_y[i] = static_cast<float>(direction.y());
    rays.direction_z[i] = static_cast<float>(direction.z());
  }
  rays.far = static_cast<float>(farthest);
  HitBatch hits;
  caster.cast(rays, hits);
  std::vector<SightLine> out(points_W.size());
  for (std::size_t i = 0; i < points_W.size(); ++i) {
    const bool is_hidden = hits.distance[i] < static_cast<float>(distances[i] - kSightMargin);
    out[i].is_free = !is_hidden;
    out[i].distance = is_hidden ? hits.distance[i] : static_cast<float>(distances[i]);
    out[i].item = is_hidden ? hits.item[i] : -1;
  }
  return out;
}

CameraCoverage camera_coverage(const RayCaster& caster, const CameraIntrinsics& camera, const Pose& X_WC,
                               double near, double far, std::span<const Eigen::Vector3d> points_W) {
  CameraCoverage out;
  out.lines = sight_lines(caster, X_WC.translation(), points_W);
  out.sights.resize(points_W.size());
  const Pose X_CW = X_WC.inverse(Eigen::Isometry);
  std::size_t seen = 0;
  for (std::size_t i = 0; i < points_W.size(); ++i) {
    const Eigen::Vector3d p_C = X_CW * points_W[i];
    const std::optional<Eigen::Vector2d> pixel = project(camera, p_C);
    // Integer coordinates are the centres of pixels, so that the picture begins half a pixel before the
    // first.
    const bool is_inside = pixel && pixel->x() >= -0.5 && pixel->x() < camera.width - 0.5 &&
                           pixel->y() >= -0.5 && pixel->y() < camera.height - 0.5;
    out.sights[i] = !is_inside              ? CameraSight::outside
                    : p_C.z() < near        ? CameraSight::too_near
                    : p_C.z() > far         ? CameraSight::too_far
                    : !out.lines[i].is_free ? CameraSight::hidden
                                            : CameraSight::seen;
    seen += out.sights[i] == CameraSight::seen ? 1 : 0;
  }
  if (!points_W.empty()) out.share = static_cast<double>(seen) / static_cast<double>(points_W.size());
  return out;
}

}  // namespace doppel
