#include "doppel/sensing/detail/rolling_shutter.h"

#include <gtest/gtest.h>

#include "doppel/scene/scene_builder.h"
#include "doppel/sensors/lens.h"

namespace doppel {
namespace {

// A camera in whose picture a thin pole stands 3 m ahead (z), and which moves to the right.
class RollingShutterTest : public ::testing::Test {
 protected:
  RollingShutterTest() {
    SceneBuilder builder;
    Pose ahead = Pose::Identity();
    ahead.translation().z() = 3.03;
    builder.add_shape(builder.add_body("pole"), Box{{0.06, 10, 0.06}}, ahead, {});
    caster_ = make_ray_caster(builder.finish());
    const std::vector<Pose> poses{Pose::Identity()};
    caster_->set_poses(poses);
    camera_.width = 160;
    camera_.height = 90;
    view_.colour = false;
    view_.labels = true;
    tables_ = pixel_rays(intrinsics_of(camera_), 1);
  }

  // The column of the pole in each row; -1: not seen.
  [[nodiscard]] std::vector<double> columns(const CameraPicture& picture) const {
    std::vector<double> out;
    for (int y = 0; y < camera_.height; ++y) {
      double sum = 0, count = 0;
      for (int x = 0; x < camera_.width; ++x)
        if (picture.labels[static_cast<std::size_t>(y * camera_.width + x)] != 0) {
          sum += x;
          ++count;
        }
      out.push_back(count > 0 ? sum / count : -1);
    }
    return out;
  }

  std::unique_ptr<RayCaster> caster_;
  CameraDescription camera_;
  CameraView view_;
  std::vector<PixelRays> tables_;
};

TEST_F(RollingShutterTest, PoleThatIsPassedIsSlantedByItsWayDuringPicture) {
  RollingShutter shutter(tables_);
  Pose last = Pose::Identity();
  last.translation().x() = 0.6;
  CameraPicture picture;
  shutter.render(*caster_, view_, Pose::Identity(), last, picture);
  ASSERT_EQ(picture.labels.size(), 160U * 90U);
  const std::vector<double> seen = columns(picture);
  const CameraIntrinsics lens = intrinsics_of(camera_);
  for (std::size_t y = 0; y < seen.size(); ++y) {
    const double x = 0.6 * static_cast<double>(y) / 89;
    EXPECT_NEAR(seen[y], lens.cx - lens.fx * x / 3, 0.8) << "row " << y;  // whole pixels, and a side face
  }
}

TEST_F(RollingShutterTest, PictureOfCameraAtRestEqualsGlobalShutter) {
  view_.samples = tables_;
  view_.colour = view_.depth = true;
  CameraPicture global, rolling;
  caster_->render(view_, global);
  RollingShutter(tables_).render(*caster_, view_, view_.X_WC, view_.X_WC, rolling);
  EXPECT_EQ(rolling.rgb, global.rgb);
  EXPECT_EQ(rolling.depth, global.depth);
  EXPECT_EQ(rolling.labels, global.labels);
}

TEST(PoseBetween, TurnsByShareOfAngleAlsoBeforeStart) {
  Pose b = Pose::Identity();
  b.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  b.translation().x() = 1;
  for (const double share : {-1.0, 0.0, 0.25, 1.0}) {
    const Pose X = pose_between(Pose::Identity(), b, share);
    EXPECT_NEAR(std::atan2(X.linear()(1, 0), X.linear()(0, 0)), 0.4 * share, 1e-12) << share;
    EXPECT_NEAR(X.translation().x(), share, 1e-12);
  }
}

}  // namespace
}  // namespace doppel
