#include "doppel/lab/verification/compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

bool has_bullet() {
  return std::ranges::any_of(known_engines(),
                             [](const KnownEngine& of) { return of.name == "bullet" && of.available; });
}

class CompareEnginesTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_bullet()) GTEST_SKIP() << "this build has no Bullet";
  }
  static RobotDescription arm() {
    std::mt19937 random(12);
    RobotDescription out = test::make_random_chain(test::six_hinges(), random);
    for (Joint& joint : out.joints) {
      joint.type = JointType::revolute;
      test::limit(joint, -3, 3, 60, 3);
      joint.dynamics = JointDynamics{0.05, 0.0, {}};
    }
    return out;
  }
  // The robot in MuJoCo, and in Bullet as `change` modifies it.
  static std::vector<ComparedEngine> engines(const RobotDescription& robot,
                                             const std::function<void(Model&)>& change = {}) {
    Diagnostics diagnostics;
    CollisionMeshes meshes;
    WorldSettings world;
    world.ground = false;
    const auto description = std::make_shared<const RobotDescription>(robot);
    Model model = compile_model(robot, BaseKind::fixed, diagnostics);
    std::vector<ComparedEngine> out;
    for (const char* const name : {"mujoco", "bullet"}) {
      Model copy = model;
      if (change && std::string_view(name) == "bullet") change(copy);
      ModelInstance instance =
          make_instance(description, std::make_shared<const Model>(std::move(copy)), {}, meshes, diagnostics);
      // The same drives, whatever was changed.
      instance.servos = choose_servos(model, {}, world.gravity);
      out.push_back({{std::move(instance), {}, world, name, {}}, name});
    }
    return out;
  }
  static CompareOptions motions(std::vector<MotionKind> kinds) {
    CompareOptions out;
    out.duration = 0.5;
    out.motions = std::move(kinds);
    return out;
  }
};

TEST_F(CompareEnginesTest, EqualModelsDifferWithinStepError) {
  const Comparison found = compare_engines(
      engines(arm()), motions({MotionKind::smooth, MotionKind::fall, MotionKind::hold, MotionKind::move}));
  EXPECT_TRUE(found.explained()) << comparison_text(found);
  for (const Difference& link : found.statics->links) EXPECT_LT(link.largest, 1e-12) << link.name;
}

TEST_F(CompareEnginesTest, ChangedInertiaIsUnexplainedAtJoint) {
  for (const int link : {2, 4, 6}) {
    const Comparison found = compare_engines(
        engines(arm(),
                [link](Model& model) { model.links[static_cast<std::size_t>(link)].inertia->I *= 1.01; }),
        motions({}));
    EXPECT_FALSE(found.explained()) << link;
    EXPECT_EQ(found.statics->joints.front().name, "joint" + std::to_string(link - 1))
        << comparison_text(found);
  }
}

TEST_F(CompareEnginesTest, FlippedAxisIsUnexplainedAtLink) {
  const Comparison found =
      compare_engines(engines(arm(), [](Model& model) { model.joints[3].axis *= -1; }), motions({}));
  EXPECT_FALSE(found.explained());
  EXPECT_THAT(verdict_line(*found.statics), HasSubstr("UNEXPLAINED: link 'link3'"));
}

TEST_F(CompareEnginesTest, MissingDampingIsUnexplainedAtJoint) {
  const Comparison found = compare_engines(engines(arm(), [](Model& model) { model.joints[2].damping = 0; }),
                                           motions({MotionKind::fall}));
  EXPECT_FALSE(found.explained());
  EXPECT_EQ(found.statics->joints.front().name, "joint2") << comparison_text(found);
  EXPECT_EQ(found.statics->joints[1].explanation, Explanation::same);
}

TEST_F(CompareEnginesTest, FrictionDifferenceIsExplained) {
  RobotDescription robot = arm();
  const Comparison found = compare_engines(
      engines(robot, [](Model& model) { model.joints[1].friction = 0.5; }), motions({MotionKind::fall}));
  // Friction is in one engine's copy only, so the first one has no such feature to remove.
  EXPECT_FALSE(found.explained());
  for (Joint& joint : robot.joints) joint.dynamics->friction = 0.1;
  const Comparison both = compare_engines(
      engines(robot, [](Model& model) { model.joints[1].friction = 0.5; }), motions({MotionKind::fall}));
  ASSERT_EQ(both.motions.size(), 1U);
  EXPECT_EQ(both.motions[0].feature, "joint friction") << comparison_text(both);
}

TEST_F(CompareEnginesTest, TextJsonAndPictureAgree) {
  const Comparison found = compare_engines(engines(arm()), motions({MotionKind::hold}));
  const std::string text = comparison_text(found);
  const auto json = nlohmann::json::parse(comparison_json(found));
  const std::string line = verdict_line(found.motions[0]);
  EXPECT_THAT(text, HasSubstr(line));
  EXPECT_THAT(text, HasSubstr(verdict_line(*found.statics)));
  EXPECT_EQ(json["motions"][0]["verdict"], line);
  EXPECT_EQ(json["statics"]["joints"].size(), 6U);
  EXPECT_EQ(json["explained"], true);
  EXPECT_THAT(comparison_svg(found, found.motions[0]), HasSubstr(line));
}

}  // namespace
}  // namespace doppel
