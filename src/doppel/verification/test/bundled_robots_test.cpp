// The robots that come with doppel, in every engine that is built here.

#include <gtest/gtest.h>

#include "doppel/description/load.h"
#include "doppel/verification/compare.h"

namespace doppel {
namespace {

class BundledRobots : public testing::TestWithParam<const char*> {
 protected:
  static std::vector<ComparedEngine> engines(const std::string& target) {
    const std::filesystem::path robots = std::filesystem::path(DOPPEL_SOURCE_DIR) / "robots";
    const Target found = resolve_target(target, robots);
    PackageResolver resolver;
    resolver.add_bundled(robots);
    resolver.add_context(found.description);
    Diagnostics heard;
    CollisionMeshes meshes;
    const auto description = std::make_shared<const RobotDescription>(
        load_description(found.description, {}, resolver, heard).robot);
    const auto model = std::make_shared<const Model>(compile_model(*description, BaseKind::fixed, heard));
    const ModelInstance robot = make_instance(description, model, {}, meshes, heard);
    std::vector<ComparedEngine> out;
    for (const KnownEngine& engine : known_engines()) {
      if (engine.available) out.push_back({{robot, {}, WorldSettings{}, engine.name, {}}, engine.name});
    }
    return out;
  }
};
INSTANTIATE_TEST_SUITE_P(Robots, BundledRobots, testing::Values("omarm_one", "omarm_zero", "lab_arm"),
                         [](const auto& of) { return std::string(of.param); });

TEST_P(BundledRobots, DifferBetweenEnginesByNothingThatIsUnexplained) {
  const std::vector<ComparedEngine> found = engines(GetParam());
  if (found.size() < 2) GTEST_SKIP() << "one engine only is built here";
  CompareOptions options;
  options.duration = 0.5;
  options.motions = {MotionKind::smooth, MotionKind::fall, MotionKind::hold, MotionKind::move};
  const Comparison comparison = compare_engines(found, options);
  EXPECT_TRUE(comparison.explained()) << comparison_text(comparison);
  if (std::getenv("DOPPEL_SHOW") != nullptr) std::puts(comparison_text(comparison).c_str());
}

}  // namespace
}  // namespace doppel
