// A calibration suggests corrections, takes samples at rest as measurements, and applies nothing twice.
#include "doppel/review/calibration/corrections.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "doppel/base/core/diagnostic.h"
#include "doppel/review/calibration/resting_position.h"

namespace doppel {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kInDegrees = std::numbers::pi / 180.0;

Joint revolute(double lower, double upper) {
  Joint joint;
  joint.name = "lift";
  joint.type = JointType::revolute;
  joint.limits = JointLimits{};
  joint.limits->lower = lower * kInDegrees;
  joint.limits->upper = upper * kInDegrees;
  joint.limits->has_position = true;
  return joint;
}

std::vector<double> suggested(const Joint& joint) {
  std::vector<double> out;
  if (const auto poses = suggested_poses(joint)) {
    for (const double one : *poses) out.push_back(one / kInDegrees);
  }
  return out;
}

TEST(SuggestedPoses, AreZeroAndRightAngleWithinLimits) {
  EXPECT_THAT(suggested(revolute(-110, 110)), ElementsAre(0, DoubleNear(90, 1e-9)));
  EXPECT_THAT(suggested(revolute(-110, 10)), ElementsAre(0, DoubleNear(-90, 1e-9)));
  EXPECT_THAT(suggested(revolute(0, 70)), ElementsAre(0, DoubleNear(70, 1e-9)));
}

TEST(SuggestedPoses, AreLimitsWhereZeroIsTooNear) {
  EXPECT_THAT(suggested(revolute(-45, 45)), ElementsAre(DoubleNear(-45, 1e-9), DoubleNear(45, 1e-9)));
  EXPECT_THAT(suggested(revolute(20, 160)), ElementsAre(DoubleNear(20, 1e-9), DoubleNear(160, 1e-9)));
}

TEST(SuggestedPoses, AreNoneForSmallRange) {
  EXPECT_THAT(suggested(revolute(-20, 30)), ElementsAre());
}

TEST(RestingPosition, FiveSamplesThatAgreeAreMean) {
  RestingPosition position;
  for (const double sample : {0.101, 0.099, std::numeric_limits<double>::quiet_NaN(), 0.1, 0.1})
    EXPECT_FALSE(position.take(sample));
  const auto found = position.take(0.1);
  ASSERT_TRUE(found);
  EXPECT_NEAR(*found, 0.1, 1e-12);
}

TEST(RestingPosition, MotionIsNoMeasurementAndSaidSo) {
  RestingPosition position;
  for (int i = 0; i < 200; ++i) EXPECT_FALSE(position.take(0.01 * i));
  EXPECT_THAT(position.refusal("lift").what(), HasSubstr("'lift' moves"));
  EXPECT_THAT(RestingPosition().refusal("lift").what(), HasSubstr("reports no position"));
}

TEST(JointCorrection, ZeroAndDirectionBecomeOperations) {
  const std::vector<Measurement> measured{{0, 0.1}, {90 * kInDegrees, 0.1 - 90 * kInDegrees}};
  const JointCorrection correction = correct_joint(revolute(-110, 110), measured, LimitChoice::keep);
  EXPECT_EQ(correction.fit.direction, -1);
  ASSERT_EQ(correction.operations.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<FlipAxis>(correction.operations[0].action));
  EXPECT_NEAR(std::get<BakeZero>(correction.operations[1].action).offset, 0.1, 1e-12);
  EXPECT_TRUE(doubts_about(revolute(-110, 110), correction.fit, measured).empty());
}

TEST(JointCorrection, ScaleIsDoubtThatNamesDriver) {
  const std::vector<Measurement> measured{{0, 0}, {90 * kInDegrees, 100 * kInDegrees}};
  const JointCorrection correction = correct_joint(revolute(-110, 110), measured, LimitChoice::keep);
  EXPECT_THAT(doubts_about(revolute(-110, 110), correction.fit, measured),
              ElementsAre(HasSubstr("in the driver")));
}

TEST(JointCorrection, SameMeasurementsAreNotAppliedTwice) {
  const std::vector<Measurement> measured{{0, 0.1}, {90 * kInDegrees, 0.1 + 90 * kInDegrees}};
  const JointCorrection correction = correct_joint(revolute(-110, 110), measured, LimitChoice::keep);
  AppliedOverlay applied;
  applied.overlay.operations = correction.operations;
  try {
    refuse_repetition("lift", correction.operations, {applied}, "arm.urdf");
    FAIL() << "the correction would act twice";
  } catch (const InputError& refused) {
    EXPECT_THAT(refused.what(), HasSubstr("doppel overlay remove arm.urdf 1"));
  }
  EXPECT_NO_THROW(refuse_repetition("pan", correction.operations, {applied}, "arm.urdf"));
}

}  // namespace
}  // namespace doppel
