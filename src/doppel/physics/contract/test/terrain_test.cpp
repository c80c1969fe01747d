// Heightmaps as shapes that collide, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "doppel/physics/contract/test/engine_fixture.h"

namespace doppel {
namespace {

using test::make_object;
using test::Rig;

constexpr double kG = 9.81;

SharedField field_of(int points, double side, const std::function<double(double, double)>& height) {
  HeightField out;
  out.columns = out.rows = points;
  out.size = {side, side};
  out.heights.resize(static_cast<std::size_t>(points) * static_cast<std::size_t>(points));
  for (int r = 0; r < points; ++r) {
    for (int c = 0; c < points; ++c) {
      const Eigen::Vector3d at = out.point(c, r);
      out.heights[static_cast<std::size_t>(r * points + c)] = static_cast<float>(height(at.x(), at.y()));
    }
  }
  return std::make_shared<const HeightField>(std::move(out));
}

// A terrain and one object on it, in the default engine.
struct OnTerrain {
  OnTerrain(const SharedField& field, const WorldObject& object, double friction) {
    WorldSettings settings = test::empty_space();
    settings.friction_rule = FrictionRule::smaller;
    RobotDescription robot;
    robot.name = "terrain";
    robot.links = {test::make_frame("l")};
    Heightmap map;
    map.field = field;
    Collision collision;
    collision.geometry = map;
    collision.surface.mu = friction;
    robot.links[0].collisions = {collision};
    const auto model = std::make_shared<const Model>(compile_model(robot, BaseKind::fixed, diagnostics));
    InstanceOptions options;
    options.passive = true;
    std::vector<ModelInstance> instances{
        make_instance(std::make_shared<const RobotDescription>(robot), model, options, meshes, diagnostics)};
    WorldObject placed = object;
    placed.friction = friction;
    instances.push_back(make_instance(placed, meshes, diagnostics));
    engine = compile_world(kDefaultEngine, settings, std::move(instances), diagnostics)->make_engine();
  }
  void run(double seconds) {
    for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) engine->step();
    ASSERT_FALSE(engine->diverged());
  }
  [[nodiscard]] Pose pose() const { return engine->find("thing")->base_pose(); }
  [[nodiscard]] Eigen::Vector3d velocity() const { return engine->find("thing")->base_velocity().linear_W; }
  [[nodiscard]] std::vector<Contact> contacts() const {
    std::vector<Contact> out;
    engine->contacts(out);
    return out;
  }
  CollisionMeshes meshes;
  Diagnostics diagnostics;
  std::unique_ptr<Engine> engine;
};

WorldObject on_slope(const Geometry& shape, double slope, double above) {
  WorldObject out = make_object("thing", shape, Eigen::Vector3d::Zero(), 1.0);
  out.X_WO = make_pose({0, 0, 0}, {0, slope, 0});
  out.X_WO.translation() = out.X_WO.linear() * Eigen::Vector3d(0.03, 0.02, above);
  return out;
}

TEST(Terrain, HeightIsThatOfTriangles) {
  const SharedField field = field_of(2, 2, [](double x, double y) { return x > 0 && y > 0 ? 1.0 : 0.0; });
  EXPECT_DOUBLE_EQ(field->height(0, 0), 0.5) << "expected the diagonal from the least x and y";
  EXPECT_DOUBLE_EQ(field->height(0.5, -0.5), 0.25);
  EXPECT_DOUBLE_EQ(field->height(-0.5, 0.5), 0.25);
  EXPECT_DOUBLE_EQ(field->height(5, 5), 1.0);
}

TEST(Terrain, BallRestsInValleyByClosedForm) {
  const double steep = 0.6, radius = 0.2;
  for (const int points : {3, 41}) {
    OnTerrain world(field_of(points, 4, [&](double x, double) { return steep * std::abs(x); }),
                    make_object("thing", Sphere{radius}, {0, 0.1, 0.25}, 1.0), 1.0);
    world.run(1.5);
    EXPECT_NEAR(world.pose().translation().z(), radius * std::sqrt(1 + steep * steep), 1e-3) << points;
    EXPECT_NEAR(world.pose().translation().x(), 0.0, 1e-3) << points;
  }
}

TEST(Terrain, ContactsOnRidgeAndPeakHaveNormalBetweenFaces) {
  const double radius = 0.2, depth = 1e-3;
  const std::function<double(double, double)> roof = [](double x, double) { return 1 - 0.5 * std::abs(x); };
  const std::function<double(double, double)> pyramid = [](double x, double y) {
    return 1 - 0.5 * std::max(std::abs(x), std::abs(y));
  };
  for (const auto& shape : {roof, pyramid}) {
    for (const double turn : {0.0, 0.2}) {
      const Eigen::Vector3d up(std::sin(turn), 0, std::cos(turn));
      OnTerrain world(
          field_of(9, 4, shape),
          make_object("thing", Sphere{radius}, Eigen::Vector3d(0, 0, 1) + (radius - depth) * up, 1.0), 1.0);
      const std::vector<Contact> found = world.contacts();
      ASSERT_EQ(found.size(), 1u);
      const Eigen::Vector3d normal =
          found[0].a.instance == 0 ? found[0].normal_W : Eigen::Vector3d(-found[0].normal_W);
      EXPECT_LT((normal - up).norm(), 1e-5) << turn;
      EXPECT_NEAR(found[0].depth, depth, 1e-6) << turn;
    }
  }
}

TEST(Terrain, ShapesRestOnSlopeAtItsHeight) {
  const double slope = 0.2;
  const auto plane = [&](double x, double) { return -std::tan(slope) * x; };
  for (const int points : {2, 7, 201}) {
    const SharedField field = field_of(points, 4, plane);
    const std::pair<Geometry, double> shapes[] = {{Box{{0.3, 0.2, 0.1}}, 0.05}, {Cylinder{0.1, 0.2}, 0.1}};
    for (const auto& [shape, half] : shapes) {
      OnTerrain world(field, on_slope(shape, slope, half + 1e-3), 0.9);
      world.run(1.0);
      const Pose before = world.pose();
      const Eigen::Vector3d foot = before * Eigen::Vector3d(0, 0, -half);
      EXPECT_NEAR(foot.z(), field->height(foot.x(), foot.y()), 5e-4) << points;
      EXPECT_GT(before.linear().col(2).dot(make_pose({}, {0, slope, 0}).linear().col(2)), 1 - 1e-6) << points;
      world.run(5.0);
      EXPECT_LT((world.pose().translation() - before.translation()).norm() * 12, 1e-4)
          << points << ": more than 0.1 mm a minute";
    }
  }
}

TEST(Terrain, BoxSlidesAsOnPlaneOfSameSlope) {
  const double slope = 0.5, friction = 0.3;
  const auto plane = [&](double x, double) { return -std::tan(slope) * x; };
  for (const int points : {2, 101}) {
    OnTerrain world(field_of(points, 20, plane), on_slope(Box{{0.3, 0.2, 0.1}}, slope, 0.0501), friction);
    world.run(0.2);
    const double before = world.velocity().norm();
    world.run(0.8);
    const double expected = kG * (std::sin(slope) - friction * std::cos(slope));
    EXPECT_NEAR((world.velocity().norm() - before) / 0.8, expected, 0.01 * kG) << points;
  }
}

TEST(Terrain, BallRollsOverEdgesOfPlaneWithoutCatching) {
  const double slope = 0.3, radius = 0.15;
  const auto plane = [&](double x, double) { return -std::tan(slope) * x; };
  for (const int points : {2, 201}) {
    OnTerrain world(field_of(points, 20, plane), on_slope(Sphere{radius}, slope, radius), 1.0);
    world.run(0.2);
    const double before = world.velocity().norm();
    world.run(1.0);
    EXPECT_NEAR(world.velocity().norm() - before, kG * std::sin(slope) / 1.4, 0.01 * kG) << points;
  }
}

TEST(Terrain, BoxRestsOnPeaks) {
  const auto bumps = [](double x, double y) {
    return std::abs(std::abs(x) - 0.5) < 0.01 && std::abs(std::abs(y) - 0.5) < 0.01 ? 0.2 : 0.0;
  };
  OnTerrain world(field_of(17, 4, bumps), make_object("thing", Box{{1.4, 1.3, 0.1}}, {0, 0, 0.251}, 1.0),
                  0.8);
  world.run(1.0);
  EXPECT_NEAR(world.pose().translation().z(), 0.25, 5e-4);
  EXPECT_GT(world.pose().linear()(2, 2), 1 - 1e-6);
}

TEST(Terrain, RayHitsSurface) {
  const auto plane = [](double x, double) { return 0.5 * x + 1; };
  OnTerrain world(field_of(5, 4, plane), make_object("thing", Sphere{0.1}, {1.5, 1.5, 5}, 1.0), 1.0);
  EXPECT_NEAR(world.engine->cast_ray({0.3, -0.4, 3}, {0, 0, -1}).distance, 3 - 1.15, 1e-6);
}

TEST(Terrain, HeightmapThatMovesCollidesWithNothing) {
  RobotDescription robot;
  robot.name = "raft";
  robot.links = {test::make_link("l", 1.0, {0, 0, 0}, {1, 1, 1})};
  Heightmap map;
  map.field = field_of(3, 1, [](double, double) { return 0.0; });
  Collision collision;
  collision.geometry = map;
  robot.links[0].collisions = {collision};
  Diagnostics diagnostics;
  CollisionMeshes meshes;
  InstanceOptions options;
  options.passive = true;
  const auto model = std::make_shared<const Model>(compile_model(robot, BaseKind::floating, diagnostics));
  const ModelInstance made =
      make_instance(std::make_shared<const RobotDescription>(robot), model, options, meshes, diagnostics);
  EXPECT_TRUE(std::ranges::all_of(made.shapes, [](const auto& shapes) { return shapes.empty(); }));
  EXPECT_EQ(diagnostics.all().back().rule, "physics.moving_heightmap");
}

}  // namespace
}  // namespace doppel
