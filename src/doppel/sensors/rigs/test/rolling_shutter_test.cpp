#include "doppel/sensors/rigs/detail/rolling_shutter.h"

#include <cstring>

#include "doppel/sensors/models/lens.h"
#include "doppel/sensors/render/scene_builder.h"
#include "light_fixture.h"

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
  PoseMotion camera;
  camera.X_WF.translation().x() = 0.6;
  camera.linear_W.x() = 3;
  CameraPicture picture;
  shutter.render(*caster_, view_, camera, Pose::Identity(), 0.2, picture);
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
  RollingShutter(tables_).render(*caster_, view_, {view_.X_WC}, Pose::Identity(), 0.1, rolling);
  EXPECT_EQ(rolling.rgb, global.rgb);
  EXPECT_EQ(rolling.depth, global.depth);
  EXPECT_EQ(rolling.labels, global.labels);
}

// The mean column of a label in each row of a picture of labels; -1: not seen.
std::vector<double> columns_of(const sensor_msgs::msg::Image& labels, std::uint16_t label) {
  std::vector<double> out;
  for (std::uint32_t y = 0; y < labels.height; ++y) {
    double sum = 0, count = 0;
    for (std::uint32_t x = 0; x < labels.width; ++x) {
      std::uint16_t value = 0;
      std::memcpy(&value, &labels.data[std::size_t{y} * labels.step + 2 * std::size_t{x}], 2);
      if (value != label) continue;
      sum += x;
      ++count;
    }
    out.push_back(count > 0 ? sum / count : -1);
  }
  return out;
}

// Of a sensor without a rate, such as a triggered one, and of one whose period is longer than its picture, or shorter.
TEST(RollingShutter, FirstPictureOfTurningCameraHasShearOfAnyRate) {
  constexpr double kDuration = 0.08, kTurn = 2;  // s, rad/s
  World in = test::room();
  in.objects.push_back(test::make_object("bar", Box{{0.06, 0.06, 10}}, {2, 0, 0}, 0));
  for (const double rate : {0.0, 10.0, 50.0}) {
    RigSensor eye = test::camera("eye", CameraKind::segmentation, rate);
    auto& camera = std::get<std::vector<CameraDescription>>(eye.description.what).front();
    camera.width = 160;
    camera.height = 90;
    camera.rolling_shutter = kDuration;
    test::LightTwin twin({eye}, {.seed = 1, .lockstep = true}, test::pole(), in);
    twin.world.set_state({0.05}, {kTurn});
    std::vector<sensor_msgs::msg::Image> pictures;
    twin.read("/eye/labels_map", pictures);
    twin.run(rate > 0 ? 1 / rate : 0.001);
    ASSERT_EQ(pictures.size(), 1U) << rate;
    const std::vector<double> seen = columns_of(pictures.front(), 2);
    const CameraIntrinsics lens = intrinsics_of(camera);
    const double turned = twin.world.q("neck"), speed = twin.world.v("neck");
    EXPECT_NEAR(speed, kTurn, 0.1);
    for (std::size_t y = 0; y < seen.size(); ++y) {
      const double angle = turned - speed * kDuration * (1 - static_cast<double>(y) / 89);
      EXPECT_NEAR(seen[y], lens.cx + lens.fx * std::tan(angle), 0.8) << rate << " Hz, row " << y;
    }
  }
}

}  // namespace
}  // namespace doppel
