#include "doppel/twin/loop/detail/oscillation_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "doppel/physics/contract/test/engine_fixture.h"

namespace doppel {
namespace {

using test::Rig;
using ::testing::HasSubstr;

RobotDescription pendulum() {
  RobotDescription robot = test::make_pendulum(1.0, 0.2);
  robot.joints[0].type = JointType::revolute;
  test::limit(robot.joints[0], -3, 3, 50, 5);
  return robot;
}

// A held joint that the torque `shake` [N m], a function of time, moves to and fro.
template <typename Shake>
std::vector<Oscillation> watched(Rig& rig, double seconds, const Shake& shake) {
  OscillationWatch watch(rig.shared);
  for (int i = 0; i < seconds * 1000; ++i) {
    rig.robot.apply_joint_effort(0, shake(1e-3 * i));
    rig.engine->step();
    watch.look(rig.robot, rig.engine->time());
  }
  return watch.take();
}

TEST(OscillationWatch, OscillatingJointIsReportedOnceWithFrequency) {
  Rig rig(pendulum());
  rig.hold_all();
  const auto found =
      watched(rig, 2.0, [](double t) { return 20.0 * std::sin(2 * std::numbers::pi * 25 * t); });
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].frequency, 25, 2.6);
  EXPECT_GT(found[0].amplitude, kMinOscillation);
  const std::string text = to_string(found[0], rig.robot);
  EXPECT_THAT(text, HasSubstr("joint 'swing' oscillates by"));
  EXPECT_THAT(text, HasSubstr("Hz while its drive holds it"));
}

TEST(OscillationWatch, SlowOscillationIsReportedAfterEnoughTurns) {
  Rig rig(pendulum());
  rig.hold_all();
  const auto found =
      watched(rig, 3.0, [](double t) { return 30.0 * std::sin(2 * std::numbers::pi * 4 * t); });
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].frequency, 4, 1.0);
}

// A load that swings beyond the effort limit drags the reference along with the joint.
TEST(OscillationWatch, OscillationBeyondEffortLimitIsReported) {
  RobotDescription robot = pendulum();
  robot.joints[0].limits->effort = 5.0;
  Rig rig(robot);
  rig.hold_all();
  const auto found =
      watched(rig, 3.0, [](double t) { return 12.0 * std::sin(2 * std::numbers::pi * 8 * t); });
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].frequency, 8, 2.0);
}

// The loop of a controller: efforts by gains, at the position that it follows.
std::vector<Oscillation> held_by_gains(double p, double d, const FollowedPosition& followed) {
  Rig rig(pendulum());
  rig.set_state({0.3});
  rig.robot.set_drive(0, DriveMode::effort);
  OscillationWatch watch(rig.shared, followed);
  for (int i = 0; i < 3000; ++i) {
    if (i % 4 == 0) rig.robot.set_target(0, p * (0.0 - rig.q("swing")) - d * rig.v("swing"));
    rig.engine->step();
    watch.look(rig.robot, rig.engine->time());
  }
  return watch.take();
}

TEST(OscillationWatch, OscillationByGainsOfControllerIsReported) {
  const auto at_zero = [](int) { return 0.0; };
  const auto found = held_by_gains(4000, 1, at_zero);
  ASSERT_EQ(found.size(), 1U);
  Rig rig(pendulum());
  EXPECT_THAT(to_string(found[0], rig.robot), HasSubstr("the gains of the controller are too high"));
  EXPECT_TRUE(held_by_gains(60, 3, at_zero).empty());
  EXPECT_TRUE(held_by_gains(4000, 1, {}).empty()) << "expected no report of efforts that hold no position";
}

// A base that rocks shakes what it carries: only a clear oscillation is one of the joint.
TEST(OscillationWatch, SmallShakingOnMovingBaseIsNotReported) {
  RobotDescription robot = pendulum();
  robot.links[0] = test::make_link("post", 5.0, {0, 0, 1.8}, {0.5, 0.5, 0.5});
  for (const bool large : {false, true}) {
    Rig rig(robot, test::empty_space(), {}, BaseKind::floating);
    rig.hold_all();
    OscillationWatch watch(rig.shared);
    const int joint = rig.joint("swing");
    for (int i = 0; i < 3000; ++i) {
      rig.robot.apply_joint_effort(joint,
                                   (large ? 20.0 : 1.0) * std::sin(2 * std::numbers::pi * 25 * 1e-3 * i));
      rig.engine->step();
      watch.look(rig.robot, rig.engine->time());
    }
    EXPECT_EQ(watch.found(), large);
  }
}

TEST(OscillationWatch, HeldJointIsNotReported) {
  Rig rig(pendulum());
  rig.set_state({1.0});
  rig.hold_all();
  EXPECT_TRUE(watched(rig, 2.0, [](double) { return 0.0; }).empty());
}

TEST(OscillationWatch, DecayingPushIsNotReported) {
  Rig rig(pendulum());
  rig.hold_all();
  EXPECT_TRUE(watched(rig, 2.0, [](double t) { return t > 0.5 && t < 0.55 ? 40.0 : 0.0; }).empty());
}

TEST(OscillationWatch, MovingTargetIsNotReported) {
  Rig rig(pendulum());
  rig.hold_all();
  OscillationWatch watch(rig.shared);
  for (int i = 0; i < 2000; ++i) {
    rig.robot.set_target(0, 0.3 * std::sin(0.05 * i));
    rig.engine->step();
    watch.look(rig.robot, rig.engine->time());
  }
  EXPECT_FALSE(watch.found());
}

TEST(OscillationWatch, OscillationAtStepRateNamesStepAsCause) {
  Rig rig(pendulum());
  const std::string text = to_string(Oscillation{0, 0.01, 250, 0.0001}, rig.robot);
  EXPECT_THAT(text, HasSubstr("the 1 ms step"));
  EXPECT_THAT(text, HasSubstr("100 times its sag"));
}

}  // namespace
}  // namespace doppel
