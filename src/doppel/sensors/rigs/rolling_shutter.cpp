#include "doppel/sensors/rigs/detail/rolling_shutter.h"

namespace doppel {

RollingShutter::RollingShutter(std::span<const PixelRays> samples) {
  const int width = samples.front().width;
  rows_.resize(static_cast<std::size_t>(samples.front().height));
  for (std::size_t y = 0; y < rows_.size(); ++y)
    for (const PixelRays& all : samples) {
      PixelRays row;
      row.width = width;
      row.height = 1;
      row.planar = all.planar;
      row.pixel_angle = all.pixel_angle;
      const auto begin = static_cast<std::ptrdiff_t>(y) * width;
      row.x.assign(all.x.begin() + begin, all.x.begin() + begin + width);
      row.y.assign(all.y.begin() + begin, all.y.begin() + begin + width);
      row.z.assign(all.z.begin() + begin, all.z.begin() + begin + width);
      rows_[y].push_back(std::move(row));
    }
}

void RollingShutter::render(const CameraRenderer& renderer, CameraView view, const PoseMotion& link,
                            const Pose& X_LC, double duration, CameraPicture& out) {
  out.rgb.clear();
  out.depth.clear();
  out.labels.clear();
  const double last = std::max<double>(1, static_cast<double>(rows_.size()) - 1);
  for (std::size_t y = 0; y < rows_.size(); ++y) {
    view.samples = rows_[y];
    view.X_WC = link.at(duration * (static_cast<double>(y) / last - 1)) * X_LC;
    renderer.render(view, row_);
    out.rgb.insert(out.rgb.end(), row_.rgb.begin(), row_.rgb.end());
    out.depth.insert(out.depth.end(), row_.depth.begin(), row_.depth.end());
    out.labels.insert(out.labels.end(), row_.labels.begin(), row_.labels.end());
  }
}

}  // namespace doppel
