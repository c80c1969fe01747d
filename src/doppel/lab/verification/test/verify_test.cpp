#include "doppel/lab/verification/verify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "doppel/physics/contract/step_scheme.h"
#include "doppel/physics/contract/test/reference_motion.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

MotionSubject subject_of(const RobotDescription& robot, const WorldSettings& world,
                         BaseKind base = BaseKind::fixed, const Eigen::VectorXd& q0 = {}) {
  Diagnostics diagnostics;
  CollisionMeshes meshes;
  const auto description = std::make_shared<const RobotDescription>(robot);
  InstanceOptions options;
  options.q0 = q0;
  options.gravity = world.gravity;
  return {make_instance(description, std::make_shared<const Model>(compile_model(robot, base, diagnostics)),
                        options, meshes, diagnostics),
          {},
          world,
          kDefaultEngine,
          {}};
}

struct Arm {
  explicit Arm(unsigned seed) : random(seed), robot(test::make_random_chain(test::six_hinges(), random)) {
    for (std::size_t i = 0; i < robot.joints.size(); ++i) {
      robot.joints[i].type = JointType::revolute;
      test::limit(robot.joints[i], -3, 3, 60, 3);
    }
  }
  [[nodiscard]] Verification verified(Integrator integrator, std::vector<MotionKind> motions,
                                      double duration = 0.3) const {
    World world;
    world.ground = false;
    world.integrator = integrator;
    return verify(subject_of(robot, world), {duration, std::move(motions), "", {}});
  }

  std::mt19937 random;
  RobotDescription robot;
};

constexpr Integrator kAll[] = {Integrator::euler, Integrator::midpoint, Integrator::rk4,
                               Integrator::implicit};

TEST(Verify, PassiveArmShowsSchemeOrder) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Arm arm(seed);
    for (const Integrator integrator : kAll) {
      const Verification found = arm.verified(integrator, {MotionKind::smooth});
      ASSERT_TRUE(found.motions[0].order) << seed;
      EXPECT_NEAR(*found.motions[0].order, step_scheme(integrator).order, 0.3)
          << name_of(integrator) << ", seed " << seed;
    }
  }
}

// The reported error is the distance from a motion that no engine integrates.
TEST(Verify, ErrorIsDistanceFromExactMotion) {
  const Arm arm(4);
  World world;
  world.ground = false;
  for (const Integrator integrator : {Integrator::euler, Integrator::midpoint}) {
    world.integrator = integrator;
    const MotionSubject subject = subject_of(arm.robot, world);
    const Verification found = verify(subject, {0.2, {MotionKind::smooth}, "", {}});
    const Motion motion(subject, MotionKind::smooth, "base");
    const MotionRecord run = motion.run(0.2, 1);
    test::ReferenceMotion reference(motion.model(), world.gravity);
    test::Motion exact{run.x.front(), Eigen::VectorXd::Zero(motion.model().nv)};
    for (int i = 0; i < 2000; ++i) {
      reference.step(exact, 1e-4,
                     [&](const test::Motion&) { return Eigen::VectorXd::Zero(motion.model().nv).eval(); });
    }
    for (std::size_t j = 0; j < found.motions[0].joints.size(); ++j) {
      const double truth =
          std::abs(run.x.back()[static_cast<Eigen::Index>(j)] - exact.q[static_cast<Eigen::Index>(j)]);
      EXPECT_NEAR(found.motions[0].joints[j].at_end, truth, 0.1 * truth + 1e-9);
    }
  }
}

TEST(Verify, FinerSchemeHasSmallerError) {
  const Arm arm(5);
  const double euler = arm.verified(Integrator::euler, {MotionKind::smooth}).motions[0].largest(false);
  const double midpoint = arm.verified(Integrator::midpoint, {MotionKind::smooth}).motions[0].largest(false);
  const double rk4 = arm.verified(Integrator::rk4, {MotionKind::smooth}).motions[0].largest(false);
  EXPECT_LT(midpoint, 0.1 * euler);
  EXPECT_LT(rk4, 0.01 * midpoint);
}

TEST(Verify, DoublePendulumIsChaotic) {
  RobotDescription robot = test::make_double_pendulum(1.0, 0.2, 1.0, 0.2);
  World world;
  world.ground = false;
  const Verification found = verify(subject_of(robot, world, BaseKind::fixed, Eigen::Vector2d(3.4, 0.3)),
                                    {10.0, {MotionKind::smooth}, "", {}});
  const MotionVerdict& motion = found.motions[0];
  ASSERT_TRUE(motion.chaotic_after);
  EXPECT_GT(*motion.chaotic_after, 0.5);
  EXPECT_LE(motion.span, *motion.chaotic_after);
  EXPECT_THAT(verdict_line(found, motion), HasSubstr("; chaotic after "));
}

TEST(Verify, EnergyDriftIsReportedWithoutDrives) {
  const Arm arm(6);
  const Verification found =
      arm.verified(Integrator::rk4, {MotionKind::smooth, MotionKind::hold, MotionKind::move});
  ASSERT_TRUE(found.motions[0].energy_drift);
  EXPECT_LT(*found.motions[0].energy_drift, 1e-6);
  EXPECT_FALSE(found.motions[1].energy_drift);
  EXPECT_FALSE(found.motions[2].energy_drift);
}

TEST(Verify, TextJsonAndPictureAgree) {
  Arm arm(7);
  arm.robot.joints[1].name = "a<b&c";
  const Verification found = arm.verified(Integrator::euler, {});
  ASSERT_EQ(found.motions.size(), 4U);
  const std::string text = verification_text(found), svg = verification_svg(found);
  const auto json = nlohmann::json::parse(verification_json(found));
  for (std::size_t i = 0; i < 4; ++i) {
    const std::string line = verdict_line(found, found.motions[i]);
    EXPECT_THAT(text, HasSubstr(line));
    EXPECT_THAT(svg, HasSubstr(line));
    EXPECT_EQ(json["motions"][i]["verdict"], line);
    EXPECT_EQ(json["motions"][i]["joints"].size(), 6U);
    EXPECT_THAT(line, HasSubstr("1 ms is accurate to"));
  }
  EXPECT_THAT(svg, HasSubstr("0.25 ms"));
}

TEST(Verify, FloatingBaseIsIncluded) {
  RobotDescription robot;
  robot.name = "tumbler";
  robot.links = {test::make_link("body", 1.0, {0, 0, 0}, {0.02, 0.05, 0.06})};
  World world;
  world.step = from_seconds(0.02);
  for (const Integrator integrator : kAll) {
    world.integrator = integrator;
    const Verification found =
        verify(subject_of(robot, world, BaseKind::floating), {3.0, {MotionKind::smooth}, "", {}});
    ASSERT_EQ(found.motions[0].joints.size(), 7U);
    EXPECT_EQ(found.tool, "body");
    EXPECT_EQ(found.motions[0].joints[5].joint, "body turn z");
    ASSERT_TRUE(found.motions[0].order) << verification_text(found);
    EXPECT_NEAR(*found.motions[0].order, step_scheme(integrator).order, 0.3);
  }
}

TEST(Verify, RobotAtRestIsReported) {
  RobotDescription robot;
  robot.name = "post";
  robot.links = {test::make_frame("post")};
  const Verification found = verify(subject_of(robot, World{}), {0.1, {}, "", {}});
  for (const MotionVerdict& motion : found.motions)
    EXPECT_THAT(verdict_line(found, motion), HasSubstr("nothing moves"));
  EXPECT_THAT(verification_svg(found), HasSubstr("</svg>"));
}

TEST(Verify, StepIndivisibleByFourIsRounded) {
  const Arm arm(9);
  World world;
  world.ground = false;
  world.integrator = Integrator::rk4;
  world.step = Duration{4'166'667};
  const Verification found = verify(subject_of(arm.robot, world), {0.3, {MotionKind::smooth}, "", {}});
  EXPECT_NEAR(found.step, 4'166'664e-9, 1e-15);
  ASSERT_TRUE(found.motions[0].order);
  EXPECT_NEAR(*found.motions[0].order, 4, 0.5);
}

TEST(Verify, LinksWithoutGravityKeepEnergy) {
  Arm arm(10);
  GazeboExtension floating;
  floating.reference = arm.robot.links[3].name;
  floating.gravity = false;
  arm.robot.gazebo.push_back(floating);
  const Verification found = arm.verified(Integrator::rk4, {MotionKind::smooth});
  ASSERT_TRUE(found.motions[0].energy_drift);
  EXPECT_LT(*found.motions[0].energy_drift, 1e-6);
}

TEST(Verify, UnknownToolIsRefusedWithNearest) {
  const Arm arm(8);
  World world;
  try {
    verify(subject_of(arm.robot, world), {0.1, {}, "bse", {}});
    FAIL() << "expected an InputError: the tool does not exist";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean 'base'?"));
  }
}

}  // namespace
}  // namespace doppel
