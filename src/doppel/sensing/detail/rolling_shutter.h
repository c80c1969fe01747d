#pragma once
// Pictures whose rows are taken one after the other, as most small cameras do: what moves past, or is passed, is slanted.

#include <span>
#include <vector>

#include "doppel/rays/ray_caster.h"

namespace doppel {

class RollingShutter {
 public:
  // The tables of a picture's pixels; see CameraView::samples.
  explicit RollingShutter(std::span<const PixelRays> samples);

  // Renders `view` with the camera at X_first in the first row, at X_last in the last one, and between them as it moves
  // with constant velocities. view.samples and view.X_WC are not read. All else stands still.
  void render(const CameraRenderer& renderer, CameraView view, const Pose& X_first, const Pose& X_last,
              CameraPicture& out);

 private:
  std::vector<std::vector<PixelRays>> rows_;  // [rows][samples]
  CameraPicture row_;
};

// The pose that is reached after `share` of the way from a to b; also before and beyond.
[[nodiscard]] Pose pose_between(const Pose& a, const Pose& b, double share);

}  // namespace doppel
