#include "doppel/sensors/rigs/detail/object_labels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "doppel/sensors/render/ray_caster.h"
#include "doppel/sensors/render/scene_builder.h"
#include "doppel/sensors/rigs/detail/pixel_formats.h"

namespace doppel {
namespace {

// Before a camera at the origin, which looks along z: a wall, before it a box, and before the right half of that a post.
struct Seen {
  CameraDescription description;
  std::shared_ptr<const RenderScene> scene;
  std::vector<Pose> bodies;
  CameraPicture picture;
  CameraIntrinsics lens;

  explicit Seen(std::optional<std::uint16_t> label_of_box) {
    SceneBuilder builder;
    const auto add = [&](const char* name, const Box& box, const Eigen::Vector3d& at,
                         std::optional<std::uint16_t> label) {
      builder.begin_model(name);
      builder.add_shape(builder.add_body(name), box, Pose::Identity(), {}, label);
      bodies.push_back(Pose::Identity());
      bodies.back().translation() = at;
    };
    add("wall", Box{{20, 20, 0.1}}, {0, 0, 6}, {});
    add("box", Box{{1, 0.5, 0.001}}, {0, 0, 3}, label_of_box);
    add("post", Box{{0.5, 0.2, 0.001}}, {0.3, 0, 2}, {});
    scene = builder.finish();
    description.width = 200;
    description.height = 100;
    lens = intrinsics_of(description);
    const auto tables = pixel_rays(lens, 1);
    const auto caster = make_ray_caster(scene);
    caster->set_poses(bodies);
    CameraView view;
    view.samples = tables;
    view.colour = false;
    view.labels = true;
    caster->render(view, picture);
  }
  [[nodiscard]] auto boxes(bool full) const {
    return boxes_of(ObjectLabels(scene), picture.labels, lens, full, bodies, Pose::Identity());
  }
};

TEST(ObjectLabels, BoxIsAroundVisiblePixelsOfLabelledModel) {
  const Seen seen(40);
  const auto boxes = seen.boxes(false);
  ASSERT_EQ(boxes.size(), 1U) << "only what has a label";
  EXPECT_EQ(boxes[0].results.at(0).hypothesis.class_id, "40");
  EXPECT_EQ(boxes[0].id, "box");
  const double left = seen.lens.cx - seen.lens.fx * 0.5 / 3, right = seen.lens.cx + seen.lens.fx * 0.5 / 3,
               height = seen.lens.fy * 0.5 / 3;
  EXPECT_NEAR(boxes[0].bbox.center.position.x, (left + right) / 2, 1) << "seen above and below the post";
  EXPECT_NEAR(boxes[0].bbox.size_x, right - left, 1.5);
  EXPECT_NEAR(boxes[0].bbox.size_y, height, 1.5);
}

TEST(ObjectLabels, FullBoxIsThatOfWholeObjectBehindOthers) {
  Seen seen(40);
  // Of the box only its left edge is seen.
  for (std::size_t i = 0; i < seen.picture.labels.size(); ++i)
    if (i % 200 > 80) seen.picture.labels[i] = 0;
  const double width = seen.lens.fx * 1 / 3;
  EXPECT_LT(seen.boxes(false).at(0).bbox.size_x, 0.5 * width);
  EXPECT_NEAR(seen.boxes(true).at(0).bbox.size_x, width + 1, 0.1);
  EXPECT_NEAR(seen.boxes(true).at(0).bbox.center.position.x, seen.lens.cx, 0.1);
}

TEST(ObjectLabels, ModelsAreObjectsInSceneWithoutLabels) {
  const Seen seen(std::nullopt);
  std::vector<std::string> classes;
  for (const auto& box : seen.boxes(false)) classes.push_back(box.results.at(0).hypothesis.class_id);
  EXPECT_EQ(classes, (std::vector<std::string>{"wall", "box", "post"}));
}

TEST(ObjectLabels, ClassIsLabelOfModelAndZeroWithoutOne) {
  const Seen seen(40);
  const ObjectLabels labels(seen.scene);
  const std::uint32_t centre_left = seen.picture.labels[50 * 200 + 85], corner = seen.picture.labels[0];
  EXPECT_EQ(labels.class_of(centre_left), 40);
  EXPECT_NE(corner, 0U) << "the wall is seen";
  EXPECT_EQ(labels.class_of(corner), 0);
}

TEST(ObjectLabels, BoxIsClippedToPicture) {
  Seen seen(40);
  Pose X_WC = Pose::Identity();
  X_WC.translation().x() = 1.6;  // the box is to the left, partly outside
  const auto tables = pixel_rays(seen.lens, 1);
  const auto caster = make_ray_caster(seen.scene);
  caster->set_poses(seen.bodies);
  CameraView view;
  view.samples = tables;
  view.X_WC = X_WC;
  view.colour = false;
  view.labels = true;
  caster->render(view, seen.picture);
  const auto boxes =
      boxes_of(ObjectLabels(seen.scene), seen.picture.labels, seen.lens, true, seen.bodies, X_WC);
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_NEAR(boxes[0].bbox.center.position.x - (boxes[0].bbox.size_x - 1) / 2, 0, 1e-9);
}

// A model of three visuals side by side, and another of one.
std::shared_ptr<const RenderScene> labelled_visuals() {
  SceneBuilder builder;
  builder.begin_model("table");
  const int table = builder.add_body("table");
  for (const std::optional<std::uint16_t> label : {std::optional<std::uint16_t>(3), {4}, {3}, {}})
    builder.add_shape(table, Box{{1, 1, 1}}, Pose::Identity(), {}, label);
  builder.begin_model("chair");
  builder.add_shape(builder.add_body("chair"), Box{{1, 1, 1}}, Pose::Identity(), {}, 3);
  return builder.finish();
}

TEST(ObjectLabels, VisualsOfModelWithSameLabelAreOneObject) {
  const ObjectLabels labels(labelled_visuals());
  EXPECT_EQ(labels.class_of(1), 3);
  EXPECT_EQ(labels.class_of(2), 4);
  EXPECT_EQ(labels.class_of(3), 3);
  EXPECT_EQ(labels.class_of(4), 0);
  EXPECT_EQ(labels.class_of(5), 3);
  EXPECT_EQ(labels.object_of(1), labels.object_of(3));
  EXPECT_NE(labels.object_of(1), labels.object_of(2));
  EXPECT_EQ(labels.object_of(4), -1);
  ASSERT_EQ(labels.objects(), 3U);
  EXPECT_EQ(labels.name(0), "table/3");
  EXPECT_EQ(labels.name(1), "table/4");
  EXPECT_EQ(labels.name(2), "chair") << "it has one label only";
  EXPECT_EQ(labels.class_id(2), "3");
}

// A box turned by 30 degrees about the vertical before a camera at the height 1, which looks along x; with `second`,
// another visual on another link of the same model.
struct Turned {
  std::shared_ptr<const RenderScene> scene;
  std::vector<Pose> bodies{make_pose({4, 0.5, 1.2}, {0, 0, M_PI / 6})};
  Pose X_CW = make_pose({0, 0, 1}, {-M_PI / 2, 0, -M_PI / 2}).inverse();

  explicit Turned(bool second) {
    SceneBuilder builder;
    builder.begin_model("crate");
    const Pose X_BV = make_pose({0.1, 0, 0}, {0, 0, 0});
    builder.add_shape(builder.add_body("crate"), Box{{1, 0.5, 0.25}}, X_BV, {}, 9);
    if (second) {
      bodies.push_back(bodies[0] * make_pose({0, 0, 1}, {0, 0, 0}));
      builder.add_shape(builder.add_body("lid"), Box{{0.5, 1, 0.25}}, Pose::Identity(), {}, 9);
    }
    scene = builder.finish();
  }
};

TEST(OrientedBoxes, TurnedBoxHasItsCentreOrientationAndSize) {
  const Turned seen(false);
  const std::uint32_t labels[] = {0, 1, 1};
  const auto boxes = oriented_boxes_of(ObjectLabels(seen.scene), labels, seen.bodies, seen.X_CW);
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_EQ(boxes[0].results.at(0).hypothesis.class_id, "9");
  EXPECT_EQ(boxes[0].id, "crate");
  const auto& [centre, size] = std::tie(boxes[0].bbox.center, boxes[0].bbox.size);
  // Ahead is x, to the left y, upwards z: z, -x, -y of the optical frame.
  EXPECT_NEAR(centre.position.z, 4 + 0.1 * std::cos(M_PI / 6), 1e-6);
  EXPECT_NEAR(centre.position.x, -(0.5 + 0.1 * std::sin(M_PI / 6)), 1e-6);
  EXPECT_NEAR(centre.position.y, -0.2, 1e-6);
  const Eigen::Quaterniond q(centre.orientation.w, centre.orientation.x, centre.orientation.y,
                             centre.orientation.z);
  const Eigen::Vector3d along = q * Eigen::Vector3d::UnitX(), up = q * Eigen::Vector3d::UnitZ();
  EXPECT_TRUE(along.isApprox(Eigen::Vector3d(-std::sin(M_PI / 6), 0, std::cos(M_PI / 6)), 1e-6));
  EXPECT_TRUE(up.isApprox(Eigen::Vector3d(0, -1, 0), 1e-6));
  EXPECT_NEAR(size.x, 1, 1e-6);
  EXPECT_NEAR(size.y, 0.5, 1e-6);
  EXPECT_NEAR(size.z, 0.25, 1e-6);
}

TEST(OrientedBoxes, SeveralVisualsHaveOneBoxInAxesOfFirstLink) {
  const Turned seen(true);
  const std::uint32_t labels[] = {2};
  const auto boxes = oriented_boxes_of(ObjectLabels(seen.scene), labels, seen.bodies, seen.X_CW);
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_NEAR(boxes[0].bbox.size.x, 1, 1e-6);  // from -0.4 to 0.6
  EXPECT_NEAR(boxes[0].bbox.size.y, 1, 1e-6);
  EXPECT_NEAR(boxes[0].bbox.size.z, 1.25, 1e-6);
  EXPECT_NEAR(boxes[0].bbox.center.position.y, -0.2 - 0.5, 1e-6);
}

TEST(OrientedBoxes, ObjectOutOfViewHasNone) {
  const Turned seen(false);
  const std::uint32_t labels[] = {0, 0};
  EXPECT_TRUE(oriented_boxes_of(ObjectLabels(seen.scene), labels, seen.bodies, seen.X_CW).empty());
}

TEST(ObjectLabels, PanopticLabelHasClassAndNumberOfInstance) {
  const ObjectLabels labels(labelled_visuals());
  EXPECT_EQ(labels.panoptic_of(0), 0U);
  EXPECT_EQ(labels.panoptic_of(1), 3U << 16 | 1);
  EXPECT_EQ(labels.panoptic_of(2), 4U << 16 | 1);
  EXPECT_EQ(labels.panoptic_of(3), labels.panoptic_of(1)) << "the same model";
  EXPECT_EQ(labels.panoptic_of(4), 0U);
  EXPECT_EQ(labels.panoptic_of(5), 3U << 16 | 2);
  sensor_msgs::msg::Image image;
  image.width = 2;
  image.height = 1;
  encode_panoptic({3U << 16 | 2, 4U << 16 | 0x1FE}, image);
  EXPECT_EQ(image.encoding, "rgb8");
  EXPECT_EQ(image.data, (std::vector<std::uint8_t>{2, 0, 3, 0xFE, 1, 4}));
}

TEST(ObjectLabels, VisualsBeyondClassesOfImageAreBackground) {
  RenderScene many;
  many.bodies.push_back({"body", 0});
  many.models.push_back({"model"});
  for (std::uint32_t i = 1; i <= 65537; ++i) many.items.push_back({0, 0, 0, Pose::Identity(), i});
  EXPECT_TRUE(lacks_classes(many));
  const ObjectLabels labels(std::make_shared<const RenderScene>(many));
  EXPECT_EQ(labels.class_of(65535), 65535);
  EXPECT_EQ(labels.class_of(65536), 0);
  EXPECT_EQ(labels.class_of(65537), 0) << "it is not the first visual";
  EXPECT_EQ(labels.object_of(65537), 0) << "its model has a box";
  many.items.back().class_label = 7;
  EXPECT_FALSE(lacks_classes(many));
}

}  // namespace
}  // namespace doppel
