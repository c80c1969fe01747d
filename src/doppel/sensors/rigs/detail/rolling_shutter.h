#pragma once
// Pictures whose rows are taken one after the other, as most small cameras do: what moves past, or is passed, is slanted.

#include <span>
#include <vector>

#include "doppel/base/math/pose_motion.h"
#include "doppel/sensors/render/ray_caster.h"

namespace doppel {

class RollingShutter {
 public:
  // The tables of a picture's pixels; see CameraView::samples.
  explicit RollingShutter(std::span<const PixelRays> samples);

  // Renders `view` with the camera, which is at X_LC in `link`, at the instant in the last row, and `duration` s before it
  // in the first one. view.samples and view.X_WC are not read. All else stands still.
  void render(const CameraRenderer& renderer, CameraView view, const PoseMotion& link, const Pose& X_LC,
              double duration, CameraPicture& out);

 private:
  std::vector<std::vector<PixelRays>> rows_;  // [rows][samples]
  CameraPicture row_;
};

}  // namespace doppel
