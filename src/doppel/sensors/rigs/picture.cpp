#include "doppel/sensors/rigs/picture.h"

#include "doppel/sensors/models/lens.h"
#include "doppel/sensors/models/sensor_frames.h"
#include "doppel/sensors/rigs/detail/world_scene.h"

namespace doppel {

Bitmap take_picture(const Engine& engine, const CameraDescription& camera, const Pose& X_WS,
                    Diagnostics& diagnostics) {
  const auto caster = make_ray_caster(make_picture_scene(engine.world(), diagnostics));
  std::vector<Pose> poses;
  read_poses(engine, poses);
  caster->set_poses(poses);
  const std::vector<PixelRays> rays = pixel_rays(intrinsics_of(camera), camera.samples);
  CameraView view;
  view.samples = rays;
  view.X_WC = X_WS * optical_axes();
  view.near = camera.near;
  view.far = camera.far;
  CameraPicture picture;
  caster->render(view, picture);
  return {camera.width, camera.height, 3, std::move(picture.rgb)};
}

Pose looking_at(const Eigen::Vector3d& from_W, const Eigen::Vector3d& at_W) {
  Pose X = Pose::Identity();
  const Eigen::Vector3d x = (at_W - from_W).normalized();
  Eigen::Vector3d y = Eigen::Vector3d::UnitZ().cross(x);
  if (y.norm() < 1e-6) y = Eigen::Vector3d::UnitY();
  y.normalize();
  X.linear() << x, y, x.cross(y);
  X.translation() = from_W;
  return X;
}

Eigen::AlignedBox3d bounds_of(const Engine& engine, Diagnostics& diagnostics) {
  const auto scene = make_picture_scene(engine.world(), diagnostics);
  std::vector<Pose> poses;
  read_poses(engine, poses);
  Eigen::AlignedBox3d box;
  for (const SceneItem& item : scene->items) {
    if (item.body == 0) continue;
    const Pose X_WM = poses[static_cast<std::size_t>(item.body)] * item.X_BM;
    for (const Eigen::Vector3f& p : scene->meshes[static_cast<std::size_t>(item.mesh)]->positions)
      box.extend(X_WM * p.cast<double>());
  }
  return box;
}

}  // namespace doppel
