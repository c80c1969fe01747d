// One list of shapes and pairs: what an engine compiles, what the audit checks and what a planner sees.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <set>

#include "doppel/description/urdf/load.h"
#include "doppel/physics/contract/exclusions.h"
#include "doppel/physics/contract/test/allocation_counter.h"
#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/robot/collision/collision_scene.h"

namespace doppel {
namespace {

using test::Rig;

RobotDescription bundled_robot(const std::string& name) {
  const std::filesystem::path robots = std::filesystem::path(DOPPEL_SOURCE_DIR) / "robots";
  PackageResolver resolver;
  resolver.add_bundled(robots);
  const Target target = resolve_target(name, robots);
  resolver.add_context(target.description);
  Diagnostics diagnostics;
  return load_description(target.description, {}, resolver, diagnostics).robot;
}

std::vector<ShapeId> ids_of(const LinkShapes& shapes) {
  std::vector<ShapeId> out;
  for (const auto& of_link : shapes) {
    for (const CollisionShape& shape : of_link) out.push_back(shape.id);
  }
  return out;
}

class WorldScene : public testing::TestWithParam<const char*> {};

TEST_P(WorldScene, EngineAuditAndSceneSeeSameShapes) {
  const RobotDescription description = bundled_robot(GetParam());
  World world;
  world.objects.push_back(test::make_object("table", Box{{1, 1, 0.1}}, {2, 0, 0.05}, 0));
  Rig rig(description, world);
  const CompiledWorld& compiled = rig.engine->world();
  const auto scene = make_collision_scene(compiled);
  const std::vector<ShapeId> of_engine = ids_of(compiled.instances()[0].shapes);
  ASSERT_FALSE(of_engine.empty());
  EXPECT_EQ(ids_of(scene->instances()[0].shapes), of_engine);
  EXPECT_EQ(ids_of(described_robot(description, rig.model).shapes), of_engine) << "as the audit sees it";
  EXPECT_EQ(std::set(of_engine.begin(), of_engine.end()).size(), of_engine.size()) << "an id is used twice";
  for (const auto& of_link : compiled.instances()[0].shapes) {
    for (const CollisionShape& shape : of_link) {
      const std::string& link = rig.model.links[static_cast<std::size_t>(shape.id.link)].name;
      const Collision& collision =
          description.find_link(link)->collisions.at(static_cast<std::size_t>(shape.id.collision));
      EXPECT_EQ(shape.source.str(), collision.source.str());
    }
  }
}

TEST_P(WorldScene, EngineTestsSamePairs) {
  World world;
  world.objects.push_back(test::make_object("table", Box{{1, 1, 0.1}}, {2, 0, 0.05}, 0));
  world.objects.push_back(test::make_object("ball", Sphere{0.05}, {1, 1, 1}, 0.1));
  Rig rig(bundled_robot(GetParam()), world);
  const CompiledWorld& compiled = rig.engine->world();
  const auto scene = make_collision_scene(compiled);
  std::set<std::pair<BodyId, BodyId>> allowed;
  for (const AllowedPair& pair : scene->allowed_pairs()) {
    EXPECT_FALSE(pair.reason.empty());
    allowed.emplace(pair.a, pair.b);
  }
  for (const ExcludedPair& pair : compiled.excluded_pairs())
    EXPECT_TRUE(allowed.contains(std::minmax(pair.a, pair.b))) << pair.reason;
  const std::size_t bodies = [&] {
    std::set<BodyId> out;
    for (const auto& [a, b] : scene->tested_pairs()) out.insert({a, b});
    for (const auto& [a, b] : allowed) out.insert({a, b});
    return out.size();
  }();
  EXPECT_EQ(scene->tested_pairs().size() + allowed.size(), bodies * (bodies - 1) / 2);
}

INSTANTIATE_TEST_SUITE_P(Robots, WorldScene, testing::Values("omarm_one", "lab_arm", "kate", "turtle"));

TEST(WorldSceneContext, QueriesDoNotAllocate) {
  World world;
  world.objects.push_back(test::make_object("table", Box{{1, 1, 0.1}}, {0.4, 0, 0.05}, 0));
  world.objects.push_back(test::make_object("can", Cylinder{0.05, 0.1}, {0.2, 0.2, 0.2}, 0.1));
  Rig rig(bundled_robot("omarm_one"), world);
  CollisionContext context(make_collision_scene(rig.engine->world()));
  SCOPED_TRACE("seed 62");
  std::mt19937 random(62);
  std::vector<Eigen::VectorXd> states;
  for (int i = 0; i < 200; ++i) {
    states.push_back(rig.model.neutral());
    for (double& q : states.back()) q += std::uniform_real_distribution(-1.5, 1.5)(random);
  }
  int collisions = 0;
  std::size_t contacts = 0;
  const std::uint64_t before = test::heap_allocations();
  for (const Eigen::VectorXd& q : states) {
    context.set_configuration(0, q);
    collisions += context.in_collision() ? 1 : 0;
    contacts += context.contacts().size();
    EXPECT_LT(context.distance().distance, 1.0);
  }
  EXPECT_EQ(test::heap_allocations() - before, 0u);
  EXPECT_GT(collisions, 20);
  EXPECT_GT(contacts, 20u);
}

}  // namespace
}  // namespace doppel
