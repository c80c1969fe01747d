#include "doppel/review/identification/servo_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "doppel/base/core/diagnostic.h"
#include "doppel/review/identification/servo_operation.h"
#include "doppel/review/identification/test/drawn_servo.h"

namespace doppel {
namespace {

using Quantity = ServoQuantity;
using ::testing::HasSubstr;

double true_value(const DrawnServo& servo, Quantity quantity) {
  return servo.values[static_cast<std::size_t>(quantity)];
}

ServoFit fit_of(const DrawnServo& servo, const JointRecord& record,
                FrictionRung last = FrictionRung::coulomb) {
  FitOptions options;
  options.start = servo.start;
  options.last = last;
  return fit_servo(record, options);
}

double error_of(const ServoFit& fit, const DrawnServo& servo, Quantity quantity) {
  return std::abs(fit[quantity].value / true_value(servo, quantity) - 1);
}

TEST(ServoFit, FindsDrawnServos) {
  for (const std::uint64_t seed : {2U, 5U}) {
    const DrawnServo servo = draw_servo(seed, FrictionRung::coulomb);
    const ServoFit fit = fit_of(servo, recording_of(servo));
    EXPECT_LT(error_of(fit, servo, Quantity::stiffness), 0.05) << seed;
    EXPECT_LT(error_of(fit, servo, Quantity::velocity), 0.05) << seed;
    EXPECT_LT(error_of(fit, servo, Quantity::damping), 0.1) << seed;
    EXPECT_LT(error_of(fit, servo, Quantity::armature), 0.1) << seed;
    EXPECT_LT(error_of(fit, servo, Quantity::friction), 0.1) << seed;
    EXPECT_NEAR(fit[Quantity::delay].value, true_value(servo, Quantity::delay), 0.003) << seed;
    EXPECT_TRUE(fit.is_white) << seed;
    EXPECT_TRUE(fit.scale_known) << seed;
    EXPECT_TRUE(fit.is_trusted(Quantity::stiffness)) << seed;
    EXPECT_NEAR(fit.tick, kTick4096, 1e-9) << seed;
    EXPECT_LT(fit.held_out_rms, 0.4 * kTick4096) << seed;
  }
}

TEST(ServoFit, IsDeterministic) {
  const DrawnServo servo = draw_servo(2, FrictionRung::none);
  const JointRecord record = recording_of(servo);
  const ServoFit first = fit_of(servo, record, FrictionRung::none),
                 second = fit_of(servo, record, FrictionRung::none);
  for (std::size_t i = 0; i < kServoQuantities; ++i) {
    EXPECT_EQ(first.values[i].value, second.values[i].value);
    EXPECT_EQ(first.values[i].high, second.values[i].high);
  }
}

TEST(ServoFit, VerticalAxisHasNoScale) {
  DrawnServo servo = draw_servo(1, FrictionRung::coulomb);
  servo.gravity = 0;
  const ServoFit fit = fit_of(servo, recording_of(servo));
  EXPECT_FALSE(fit.scale_known);
  EXPECT_THAT(fit[Quantity::stiffness].problem,
              HasSubstr("scale not identifiable, because the axis is vertical: lay the arm down"));
  EXPECT_FALSE(fit.is_trusted(Quantity::stiffness));
  EXPECT_FALSE(fit.is_trusted(Quantity::friction));
  EXPECT_TRUE(fit[Quantity::velocity].problem.empty()) << "a speed has no scale of torque";
}

// A servo that follows small steps without its speed limit: D and V act as D + V, but for while it is off.
TEST(ServoFit, ReleaseSeparatesDampingAndViscousFriction) {
  DrawnServo servo = draw_servo(1, FrictionRung::coulomb);
  servo.values[static_cast<std::size_t>(Quantity::velocity)] = 40;
  servo.start[static_cast<std::size_t>(Quantity::velocity)] = 30;
  const ServoFit without = fit_of(servo, recording_of_steps(servo, 0));
  EXPECT_THAT(without[Quantity::damping].problem,
              HasSubstr("drive damping and viscous friction are one number"));
  EXPECT_EQ(without[Quantity::viscous].problem, without[Quantity::damping].problem);
  EXPECT_FALSE(without.is_trusted(Quantity::damping));
  const ServoFit fit = fit_of(servo, recording_of_steps(servo, 3));
  EXPECT_LT(error_of(fit, servo, Quantity::damping), 0.1);
  EXPECT_LT(error_of(fit, servo, Quantity::viscous), 0.1);
  EXPECT_TRUE(fit.is_trusted(Quantity::damping));
  EXPECT_TRUE(fit.is_trusted(Quantity::viscous));
}

// The whole motion with falls of 0.1 s: the interval of viscous friction is half as wide.
TEST(ServoFit, ReleaseNarrowsIntervalOfViscousFriction) {
  const DrawnServo servo = draw_servo(1, FrictionRung::coulomb);
  const auto width = [](const FittedValue& value) { return std::log(value.high / value.low); };
  const ServoFit without = fit_of(servo, recording_of(servo));
  const ServoFit fit = fit_of(servo, recording_with_releases(servo, 3));
  EXPECT_TRUE(fit.is_white);
  EXPECT_LT(width(fit[Quantity::viscous]), 0.6 * width(without[Quantity::viscous]));
  EXPECT_LT(error_of(fit, servo, Quantity::viscous), 0.05);
}

TEST(ServoFit, EffortLimitThatActsIsFoundFromTwiceItsValue) {
  const DrawnServo servo = draw_servo(2, FrictionRung::coulomb);
  const ServoFit fit = fit_of(servo, recording_with_releases(servo, 3));
  EXPECT_LT(error_of(fit, servo, Quantity::effort), 0.02);
  EXPECT_TRUE(fit.is_white);
}

TEST(ServoFit, LimitThatIsNotReachedIsNotIdentifiable) {
  const DrawnServo servo = draw_servo(1, FrictionRung::coulomb);
  const ServoFit fit = fit_of(servo, recording_of(servo));
  EXPECT_THAT(fit[Quantity::effort].problem, HasSubstr("the effort limit was never reached"));
  EXPECT_FALSE(fit.is_trusted(Quantity::effort));
  const ServoWriting writing = servo_operation("J", fit, true);
  ASSERT_TRUE(writing.operation.has_value());
  EXPECT_FALSE(writing.operation->effort.has_value()) << "never written, whatever is accepted";
  EXPECT_NEAR(*writing.operation->resolution, kTick4096, 1e-6);
  EXPECT_THAT(writing.left_out.front(), HasSubstr("effort is not written: not identifiable"));
}

// The inertia that the other joints take along in a fast motion is not resolved by the samples.
TEST(ServoFit, YieldingOfOtherJointsHidesArmature) {
  const DrawnServo servo = draw_servo(2, FrictionRung::coulomb);
  JointRecord record = recording_of(servo);
  record.yielding = 0.9;
  const ServoFit fit = fit_of(servo, record);
  EXPECT_THAT(fit[Quantity::armature].problem, HasSubstr("the other joints yield in fast motions, by 90 %"));
  EXPECT_TRUE(fit.is_trusted(Quantity::stiffness));
}

TEST(ServoFit, NoiseAsDataIsNotTrusted) {
  const DrawnServo servo = draw_servo(2, FrictionRung::coulomb);
  JointRecord record = recording_of(servo);
  std::mt19937_64 bits(7);
  for (double& q : record.position)
    q = std::round((static_cast<double>(bits() % 1000) / 1000 - 0.5) / kTick4096) * kTick4096;
  const ServoFit fit = fit_of(servo, record);
  for (std::size_t i = 0; i < kServoQuantities; ++i)
    EXPECT_FALSE(fit.is_trusted(static_cast<Quantity>(i))) << i;
  EXPECT_FALSE(fit.warnings.empty());
  EXPECT_FALSE(servo_operation("J", fit, false).operation.has_value());
}

TEST(ServoFit, SmallerModelThanServoWarns) {
  const DrawnServo servo = draw_servo(1, FrictionRung::load);
  const ServoFit fit = fit_of(servo, recording_of(servo));
  EXPECT_FALSE(fit.is_white);
  ASSERT_FALSE(fit.warnings.empty());
  EXPECT_THAT(fit.warnings.front(), HasSubstr("the model M1 does not have"));
  EXPECT_FALSE(servo_operation("J", fit, false).operation.has_value());
  const ServoWriting accepted = servo_operation("J", fit, true);
  ASSERT_TRUE(accepted.operation.has_value());
  EXPECT_NEAR(*accepted.operation->stiffness / true_value(servo, Quantity::stiffness), 1, 0.2);
}

TEST(ServoFit, LadderStopsAtServosClass) {
  const DrawnServo servo = draw_servo(2, FrictionRung::coulomb);
  const ServoFit fit = fit_of(servo, recording_of(servo), FrictionRung::stribeck);
  EXPECT_EQ(fit.rung, FrictionRung::coulomb);
  EXPECT_EQ(fit.ladder.size(), 3U);
}

TEST(ServoFit, ShortOrMotionlessRecordingIsRefused) {
  const DrawnServo servo = draw_servo(2, FrictionRung::coulomb);
  const JointRecord whole = recording_of(servo);
  const auto rule = [&](const JointRecord& record) {
    try {
      fit_of(servo, record);
    } catch (const InputError& problem) {
      return problem.diagnostics().front().rule;
    }
    return std::string("accepted");
  };
  JointRecord record = whole;
  record.time.resize(100);
  EXPECT_EQ(rule(record), "identify.too_short");
  record = whole;
  record.time[10] = record.time[9];
  EXPECT_EQ(rule(record), "identify.times");
  record = whole;
  record.command.assign(record.command.size(), 1.0);
  EXPECT_EQ(rule(record), "identify.no_motion");
}

TEST(EstimatedTick, IsThatOfRounding) {
  EXPECT_NEAR(estimate_tick(recording_of(draw_servo(1, FrictionRung::coulomb)).position), kTick4096, 1e-9);
  std::vector<double> smooth;
  for (int i = 0; i < 500; ++i) smooth.push_back(std::sin(0.01 * i));
  EXPECT_EQ(estimate_tick(smooth), 0);
}

}  // namespace
}  // namespace doppel
