#include "doppel/physics/contract/world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "doppel/physics/contract/engine.h"
#include "doppel/physics/contract/test/engine_fixture.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

std::filesystem::path written(const std::string& text) {
  const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
  const std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / (std::string(test->name()) + ".yaml");
  std::ofstream(file) << text;
  return file;
}

World loaded(const std::string& text) {
  PackageResolver resolver;
  return load_world(written(text), resolver);
}

std::string error_of(const std::string& text) {
  try {
    loaded(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(WorldFile, EveryKeyIsRead) {
  const World world = loaded(R"(
name: bench
gravity: [0, 0, -1.62]
step: 0.0005
integrator: rk4
ground: {friction: 0.3, restitution: 0.9}
robot: {xyz: [0, 0, 0.4], rpy: [0, 0, 1.5]}
objects:
  - {name: desk, box: [1, 2, 0.4], xyz: [0, 0, 0.2]}
  - {name: ball, sphere: {radius: 0.03}, mass: 0.05, friction: 0.5, restitution: 0.4, color: [1, 0, 0, 1]}
  - {name: can, cylinder: {radius: 0.03, length: 0.1}, mass: 0.2}
  - {name: pill, capsule: {radius: 0.01, length: 0.1}, mass: 0.2}
friction_rule: min
)");
  EXPECT_EQ(world.name, "bench");
  EXPECT_EQ(world.gravity.z(), -1.62);
  EXPECT_EQ(world.step, Duration(500'000));
  EXPECT_EQ(world.integrator, Integrator::rk4);
  EXPECT_TRUE(world.ground);
  EXPECT_EQ(world.ground_friction, 0.3);
  EXPECT_EQ(world.ground_restitution, 0.9);
  EXPECT_EQ(world.friction_rule, FrictionRule::smaller);
  EXPECT_EQ(world.X_WR.translation().z(), 0.4);
  ASSERT_EQ(world.objects.size(), 4u);
  EXPECT_EQ(std::get<Box>(world.objects[0].shape).size.y(), 2);
  EXPECT_EQ(world.objects[0].mass, 0) << "expected a static object";
  EXPECT_EQ(world.objects[1].mass, 0.05);
  EXPECT_EQ(world.objects[1].restitution, 0.4);
  EXPECT_EQ(world.objects[2].restitution, std::nullopt);
  EXPECT_EQ(world.objects[1].rgba.x(), 1);
  EXPECT_EQ(std::get<Cylinder>(world.objects[2].shape).length, 0.1);
  EXPECT_EQ(world.objects[2].source.line, 11);
}

TEST(WorldFile, EmptyFileIsEmptyWorld) {
  const World world = loaded("");
  EXPECT_TRUE(world.objects.empty());
  EXPECT_EQ(world.step, Duration(1'000'000));
}

TEST(WorldFile, ErrorHasPlaceAndReason) {
  EXPECT_THAT(error_of("gravty: [0, 0, -9.81]"), HasSubstr(".yaml:1:1: error: a world has no key 'gravty'"));
  EXPECT_THAT(error_of("gravty: [0, 0, -9.81]"), HasSubstr("did you mean 'gravity'"));
  EXPECT_THAT(error_of("name: a\ngravity: [0, x, 1]"),
              HasSubstr(":2:14: error: gravity must be a number, not 'x'"));
  EXPECT_THAT(error_of("gravity: [0, 1]"), HasSubstr("a list of 3 numbers"));
  EXPECT_THAT(error_of("gravity: [0, 0, .nan]"), HasSubstr("must be a number"));
  EXPECT_THAT(error_of("step: 0"), HasSubstr("must be from"));
  EXPECT_THAT(error_of("step: 1"), HasSubstr("must be from"));
  EXPECT_THAT(error_of("integrator: implicid"), HasSubstr("did you mean 'implicit'"));
  EXPECT_THAT(error_of("ground: maybe"), HasSubstr("not 'maybe'"));
  EXPECT_THAT(error_of("name: a\nname: b"), HasSubstr("is given twice"));
  EXPECT_THAT(error_of("[1, 2]"), HasSubstr("must be a map"));
  EXPECT_THAT(error_of("name: [unclosed"), HasSubstr("not YAML"));
}

TEST(WorldFile, InvalidObjectsAreRefused) {
  EXPECT_THAT(error_of("objects:\n  - {box: [1, 1, 1]}"), HasSubstr(":2:5: error: an object needs a name"));
  EXPECT_THAT(error_of("objects:\n  - {name: a}"), HasSubstr("exactly one shape"));
  EXPECT_THAT(error_of("objects:\n  - {name: a, box: [1, 1, 1], sphere: {radius: 1}}"), HasSubstr("not 2"));
  EXPECT_THAT(error_of("objects:\n  - {name: a, box: [1, 0, 1]}"), HasSubstr("positive"));
  EXPECT_THAT(error_of("objects:\n  - {name: a, sphere: {radius: -1}}"), HasSubstr("must be positive"));
  EXPECT_THAT(error_of("objects:\n  - {name: a, cylinder: {radius: 1}}"), HasSubstr("needs a length"));
  EXPECT_THAT(error_of("objects:\n  - {name: a, sphere: {radius: 1}, mass: -1}"),
              HasSubstr("cannot be negative"));
  EXPECT_THAT(error_of("objects:\n  - {name: a, sphere: {radius: 1}, mass: 1e-7}"),
              HasSubstr("the mass is 1e-07 kg; it must be from 1e-06"));
  EXPECT_THAT(error_of("objects:\n  - {name: a, sphere: {radius: 1}}\n  - {name: a, sphere: {radius: 1}}"),
              HasSubstr("the first is at"));
  EXPECT_THAT(error_of("objects:\n  - {name: ground, sphere: {radius: 1}}"), HasSubstr("reserved"));
  EXPECT_THAT(error_of("objects:\n  - {name: a, mesh: nowhere.stl}"),
              HasSubstr("'nowhere.stl' is not found"));
  EXPECT_THAT(error_of("objects:\n  - {name: a, sphere: {radius: 1}, color: [1, 2, 0, 1]}"),
              HasSubstr("from 0 to 1"));
}

TEST(WorldFile, ErrorsAreReportedTogether) {
  const std::string text = error_of("step: 0\nobjects:\n  - {name: a, bx: [1, 1, 1]}");
  EXPECT_THAT(text, HasSubstr("must be from"));
  EXPECT_THAT(text, HasSubstr("did you mean 'box'"));
}

// The objects of the bundled worlds are at rest.
TEST(WorldFile, BundledWorldsAreAtRest) {
  PackageResolver resolver;
  for (const auto& entry : std::filesystem::directory_iterator(DOPPEL_SOURCE_DIR "/worlds")) {
    if (entry.path().extension() != ".yaml") continue;
    SCOPED_TRACE(entry.path().string());
    const World world = load_world(entry.path(), resolver);
    test::Rig rig(test::make_post(), world);
    rig.run(3.0);
    for (const WorldObject& object : world.objects) {
      EXPECT_LT((rig.pose(object.name).translation() - object.X_WO.translation()).norm(), 2e-3)
          << object.name;
    }
  }
}

}  // namespace
}  // namespace doppel
