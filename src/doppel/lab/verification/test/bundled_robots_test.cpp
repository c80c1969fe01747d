// The bundled robots, in every engine of this build.

#include <gtest/gtest.h>

#include "doppel/description/urdf/load.h"
#include "doppel/lab/verification/compare.h"

namespace doppel {
namespace {

struct Loaded {
  static std::vector<ComparedEngine> engines(const std::string& target) {
    const std::filesystem::path robots = std::filesystem::path(DOPPEL_SOURCE_DIR) / "robots";
    const Target found = resolve_target(target, robots);
    PackageResolver resolver;
    resolver.add_bundled(robots);
    resolver.add_context(found.description);
    Diagnostics diagnostics;
    CollisionMeshes meshes;
    const auto description = std::make_shared<const RobotDescription>(
        load_description(found.description, {}, resolver, diagnostics).robot);
    const auto model =
        std::make_shared<const Model>(compile_model(*description, BaseKind::fixed, diagnostics));
    const ModelInstance robot = make_instance(description, model, {}, meshes, diagnostics);
    std::vector<ComparedEngine> out;
    for (const KnownEngine& engine : known_engines()) {
      if (engine.available) out.push_back({{robot, {}, WorldSettings{}, engine.name, {}}, engine.name});
    }
    return out;
  }
};

class BundledRobotsTest : public testing::TestWithParam<const char*>, protected Loaded {};
class BundledTrajectoriesTest : public testing::Test, protected Loaded {};
INSTANTIATE_TEST_SUITE_P(Robots, BundledRobotsTest,
                         testing::Values("omarm_one", "omarm_zero", "lab_arm", "desk_arm"),
                         [](const auto& of) { return std::string(of.param); });

TEST_P(BundledRobotsTest, EngineDifferencesAreExplained) {
  const std::vector<ComparedEngine> found = engines(GetParam());
  if (found.size() < 2) GTEST_SKIP() << "this build has only one engine";
  CompareOptions options;
  options.duration = 0.5;
  options.motions = {MotionKind::smooth, MotionKind::fall, MotionKind::hold, MotionKind::move};
  const Comparison comparison = compare_engines(found, options);
  EXPECT_TRUE(comparison.explained()) << comparison_text(comparison);
  if (std::getenv("DOPPEL_SHOW") != nullptr) std::puts(comparison_text(comparison).c_str());
}

// The motion that the twins' tests send: from the initial pose through two poses, each in two seconds.
TEST_F(BundledTrajectoriesTest, OmarmOneFollowsSampleInEveryEngine) {
  std::vector<ComparedEngine> found = engines("omarm_one");
  if (found.size() < 2) GTEST_SKIP() << "this build has only one engine";
  JointPath path;
  for (int i = 1; i <= 6; ++i) path.joints.push_back("Revolute " + std::to_string(i));
  path.times = {2.0, 4.0};
  path.positions = {{1.0, 1.2, 1.57, 1.57, 1.57, 1.57}, {0.3, 1.4, 1.2, 1.4, 1.3, 1.1}};
  for (ComparedEngine& engine : found) engine.subject.path = path;
  CompareOptions options;
  options.statics = false;
  options.duration = 5.0;
  options.motions = {MotionKind::path};
  const Comparison comparison = compare_engines(found, options);
  for (const Difference& joint : comparison.motions[0].joints)
    EXPECT_LT(joint.largest, 0.02) << joint.name << "\n" << comparison_text(comparison);
  // Each engine reaches the goal.
  for (const ComparedEngine& engine : found) {
    const Motion motion(engine.subject, MotionKind::path, "");
    const MotionRecord record = motion.run(5.0, 1);
    for (std::size_t j = 0; j < motion.coordinates().size(); ++j) {
      const auto at = std::ranges::find(path.joints, motion.coordinates()[j].name);
      if (at == path.joints.end()) continue;
      const double wanted = path.positions.back()[static_cast<std::size_t>(at - path.joints.begin())];
      EXPECT_NEAR(record.x.back()[static_cast<Eigen::Index>(j)], wanted, 0.006)
          << "expected the goal to be reached: " << engine.label << ", " << *at;
    }
  }
}

}  // namespace
}  // namespace doppel
