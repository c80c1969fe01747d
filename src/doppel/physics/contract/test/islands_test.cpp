// Instances that do not touch move as if each were alone, to the bit; those that touch are solved together.

#include <gtest/gtest.h>

#include <random>

#include "doppel/physics/contract/test/allocation_counter.h"
#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/physics/contract/test/mujoco_extras.h"

namespace doppel {
namespace {

using test::make_object;

// `count` boxes, the lowest on the ground, thrown together around x. Ten boxes are 60 degrees of freedom, from
// which on MuJoCo's matrices are sparse.
std::vector<WorldObject> heap(const std::string& name, double x, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> near(-0.03, 0.03);
  std::vector<WorldObject> out;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d at(x + near(random), near(random), 0.06 + 0.11 * i);
    out.push_back(make_object(name + std::to_string(i), Box{{0.1, 0.1, 0.1}}, at, 0.5));
  }
  return out;
}

std::vector<WorldObject> together(std::vector<WorldObject> a, const std::vector<WorldObject>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

struct Heaps {
  explicit Heaps(const std::vector<WorldObject>& objects) {
    std::vector<ModelInstance> instances;
    for (const WorldObject& object : objects) instances.push_back(make_instance(object, meshes, diagnostics));
    engine = compile_world("mujoco", World{}, std::move(instances), diagnostics)->make_engine();
  }
  void run(int steps) {
    for (int i = 0; i < steps; ++i) engine->step();
    ASSERT_FALSE(engine->diverged());
  }
  [[nodiscard]] std::vector<double> state(const std::vector<WorldObject>& objects) const {
    std::vector<double> out;
    for (const WorldObject& object : objects) {
      const Instance of = std::as_const(*engine).find(object.name).value();
      out.insert(out.end(), of.q().begin(), of.q().end());
      out.insert(out.end(), of.v().begin(), of.v().end());
    }
    return out;
  }
  Diagnostics diagnostics;
  CollisionMeshes meshes;
  std::unique_ptr<Engine> engine;
};

TEST(Islands, HeapsMoveBitIdenticallyToEachAlone) {
  for (const auto& [left, right] : {std::pair(3, 1), std::pair(4, 5), std::pair(11, 2)}) {
    SCOPED_TRACE(std::to_string(left) + " and " + std::to_string(right) + " boxes");
    const auto a = heap("a", 0, left, 1), b = heap("b", 30, right, 2);
    Heaps both(together(a, b)), only_a(a), only_b(b);
    for (Heaps* const heaps : {&both, &only_a, &only_b}) heaps->run(400);
    EXPECT_EQ(both.state(a), only_a.state(a));
    EXPECT_EQ(both.state(b), only_b.state(b));
  }
}

// MuJoCo's whole solver stops at a tolerance, so that the two agree by their digits.
TEST(Islands, AccelerationsAgreeWithWholeSolution) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const int count = 2 + static_cast<int>(seed);
    Heaps heaps(together(heap("a", 0, count, seed), heap("b", 1, 14 - count, 100 + seed)));
    double largest = 0;
    for (int i = 0; i < 40; ++i) {
      heaps.run(10);
      largest = std::max(largest, difference_of_islands(*heaps.engine));
    }
    EXPECT_LT(largest, 1e-5);
  }
}

TEST(Islands, BoxThatMeetsHeapPushesIt) {
  const auto a = heap("a", 0, 1, 1), b = heap("b", 0.5, 1, 2);
  Heaps heaps(together(a, b));
  heaps.run(300);
  const double before = heaps.engine->find("b0")->base_pose().translation().x();
  heaps.engine->find("a0")->set_base_velocity({{6, 0, 0}, {0, 0, 0}});
  heaps.run(1000);
  EXPECT_GT(heaps.engine->find("b0")->base_pose().translation().x(), before + 0.02);
}

TEST(Islands, StepDoesNotAllocate) {
  Heaps heaps(together(heap("a", 0, 12, 1), heap("b", 1, 3, 2)));
  heaps.run(300);
  const std::uint64_t before = test::heap_allocations();
  for (int i = 0; i < 100; ++i) heaps.engine->step();
  EXPECT_EQ(test::heap_allocations(), before);
}

}  // namespace
}  // namespace doppel
