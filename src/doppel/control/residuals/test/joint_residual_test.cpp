#include "doppel/control/residuals/joint_residual.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

namespace doppel {
namespace {

constexpr double kStep = 0.01;
constexpr double kNoise = 0.0015;     // rad, a tick of 4096
constexpr double kLoadNoise = 0.005;  // of the stall torque

double moving(double t) {
  return 0.5 * std::sin(1.3 * t) + 0.2 * std::sin(3.1 * t);
}

double fast(double t) {  // 2.8 rad/s
  return 0.8 * std::sin(3.5 * t);
}

// The joint of a twin moves as `twin(t)`; that of the hardware follows 47 ms later, with noise.
class JointResidualTest : public testing::Test {
 protected:
  using Path = std::function<double(double)>;
  using Change = std::function<void(double t, ResidualSample&)>;
  static constexpr double kDelay = 0.047;

  void run(double seconds, const Path& twin, const Change& change = {}) {
    std::normal_distribution noise(0.0, kNoise), load_noise(0.0, kLoadNoise);
    const double end = time_ + seconds;
    for (; time_ < end; time_ += kStep) {
      ResidualSample sample{twin(time_ - kDelay) + noise(random_), twin(time_), 0.2 + load_noise(random_),
                            0.2, false};
      if (change) change(time_, sample);
      residual_.add(sample);
      if (residual_.alarm() != ResidualCause::none && alarm_at_ < 0) alarm_at_ = time_;
    }
  }
  void expect_alarm(double begin, double within, ResidualCause cause) {
    ASSERT_GE(alarm_at_, begin) << "an alarm before the fault";
    EXPECT_LE(alarm_at_, begin + within);
    EXPECT_EQ(residual_.alarm(), cause) << to_string(residual_.alarm());
  }
  std::mt19937_64 random_{7};
  JointResidual residual_;
  double time_ = 0, alarm_at_ = -1;
};

class JointResidualWithSigma : public JointResidualTest {
 protected:
  static constexpr double kSigma = 0.005;
  JointResidualWithSigma() { residual_ = JointResidual({.sigma = kSigma}); }
};

TEST_F(JointResidualTest, SlowDriftIsNotLearnedAsNoise) {
  run(60, moving);
  run(60, moving, [](double t, ResidualSample& sample) { sample.measured += 0.002 * (t - 60); });
  ASSERT_GE(alarm_at_, 60);
  EXPECT_LE(alarm_at_, 100) << "0.08 rad apart";
}

TEST_F(JointResidualTest, OffsetAtStartIsNotLearnedAsNoise) {
  run(20, moving, [](double, ResidualSample& sample) { sample.measured += 0.09; });
  EXPECT_GE(alarm_at_, 0);
}

TEST_F(JointResidualTest, MotionGivesDelayWithinFiveMilliseconds) {
  run(12, moving);
  EXPECT_NEAR(residual_.delay(), kDelay, 0.005);
  EXPECT_LT(residual_.rms(), 3 * kNoise);
}

TEST_F(JointResidualTest, RestGivesNoDelayAndNoAlarm) {
  run(15, [](double) { return 0.3; });
  EXPECT_TRUE(std::isnan(residual_.delay()));
  EXPECT_EQ(residual_.alarms(), 0u);
  EXPECT_LT(std::abs(residual_.error()), 5 * kNoise);
}

TEST_F(JointResidualTest, MotionBeforeDelayIsKnownGivesNoAlarm) {
  run(9, moving);
  EXPECT_TRUE(std::isnan(residual_.delay()));
  EXPECT_EQ(residual_.alarms(), 0u);
}

TEST_F(JointResidualTest, HourOfNoiseGivesNoAlarm) {
  run(3600, moving);
  EXPECT_EQ(residual_.alarms(), 0u);
}

TEST_F(JointResidualWithSigma, HourOfNoiseGivesNoAlarm) {
  run(3600, moving);
  EXPECT_EQ(residual_.alarms(), 0u);
}

TEST_F(JointResidualTest, NoiseOfQuietMotionIsLearned) {
  run(30.0, moving);
  EXPECT_NEAR(residual_.sigma(), kNoise, 0.2 * kNoise);
}

TEST_F(JointResidualWithSigma, IdentifiedSigmaIsLeast) {
  run(60.0, moving);
  EXPECT_DOUBLE_EQ(residual_.sigma(), kSigma);
  run(2.0, moving, [](double, ResidualSample& sample) { sample.measured += 0.015; });
  EXPECT_EQ(residual_.alarms(), 0u) << "three of its sigmas";
}

TEST_F(JointResidualTest, TenSigmasAreAlarm) {
  run(60.0, moving);
  const double begin = time_;
  run(1.0, moving, [](double, ResidualSample& sample) { sample.measured += 0.015; });
  expect_alarm(begin, 0.3, ResidualCause::slipped_horn);
}

// The alarm at rest stays as fine as it is: noise of the delay is not one of the position.
TEST_F(JointResidualTest, UnsteadyDelayIsNoAlarmAndAlarmAtRestStays) {
  std::uniform_real_distribution late(-0.006, 0.006);
  double extra = 0;
  run(600.0, fast, [&](double t, ResidualSample& sample) {
    if (std::fmod(t, 0.2) < kStep) extra = late(random_);
    sample.measured += fast(t - kDelay - extra) - fast(t - kDelay);
  });
  EXPECT_EQ(residual_.alarms(), 0u);
  EXPECT_LT(residual_.sigma(), 2 * kNoise);
  const double rest = fast(time_), begin = time_ + 2;
  run(2.0, [rest](double) { return rest; });
  run(
      1.0, [rest](double) { return rest; }, [](double, ResidualSample& sample) { sample.measured += 0.02; });
  expect_alarm(begin, 0.5, ResidualCause::slipped_horn);
}

TEST_F(JointResidualTest, AlarmIsNotLearned) {
  run(12.0, moving);
  run(120.0, moving, [](double, ResidualSample& sample) { sample.measured += 0.1; });
  EXPECT_NE(residual_.alarm(), ResidualCause::none);
  EXPECT_LT(residual_.sigma(), 2 * kNoise);
}

TEST_F(JointResidualTest, RestartKeepsNoiseAndDelay) {
  run(30.0, moving);
  residual_.restart();
  EXPECT_LT(residual_.sigma(), 2 * kNoise);
  EXPECT_NEAR(residual_.delay(), kDelay, 0.005);
}

TEST_F(JointResidualTest, BlockedJointIsStallWithinHalfSecond) {
  run(13.0, moving);
  const double begin = time_, still = moving(begin);
  run(1.0, moving, [&](double, ResidualSample& sample) {
    sample.measured = still;
    sample.load = 0.9;
  });
  expect_alarm(begin, 0.5, ResidualCause::stall);
}

TEST_F(JointResidualTest, BlockedJointWithoutLoadIsStallWithinHalfSecond) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  run(13.0, moving, [](double, ResidualSample& sample) { sample.load = kNone; });
  const double begin = time_, still = moving(begin);
  run(1.0, moving, [&](double, ResidualSample& sample) {
    sample.measured = still;
    sample.load = kNone;
  });
  expect_alarm(begin, 0.5, ResidualCause::stall);
}

// The joint of a stiff servo gives way by five ticks.
TEST_F(JointResidualTest, WeightIsPayloadWithinHalfSecond) {
  run(12.0, moving);
  const double begin = time_;
  run(1.0, moving, [&](double t, ResidualSample& sample) {
    sample.load += 0.12;
    sample.measured -= 0.008 * (1 - std::exp(-(t - begin) / 0.08));
  });
  expect_alarm(begin, 0.5, ResidualCause::payload);
}

// Neither is evidence alone: two sigmas of the error, and seven of the load, which noise may have together.
TEST_F(JointResidualWithSigma, LoadWithSagIsPayloadAndLoadThatLiftsIsNot) {
  run(12.0, moving);
  const auto change = [](double sag) {
    return [sag](double, ResidualSample& sample) {
      sample.load += 0.07;
      sample.measured -= sag;
    };
  };
  run(1.0, moving, change(-0.01));
  EXPECT_EQ(residual_.alarms(), 0u);
  run(5.0, moving);
  const double begin = time_;
  run(1.0, moving, change(0.01));
  expect_alarm(begin, 0.5, ResidualCause::payload);
}

// The servo turns against its joint and has another stall torque than described.
TEST_F(JointResidualTest, LoadsOfTurnedShaftAreLearned) {
  const auto turn = [](ResidualSample& sample) { sample.load *= -1.5; };
  run(30.0, moving, [&](double, ResidualSample& sample) { turn(sample); });
  EXPECT_EQ(residual_.alarms(), 0u);
  const double begin = time_;
  run(1.0, moving, [&](double, ResidualSample& sample) {
    sample.load += 0.12;
    sample.measured -= 0.008;
    turn(sample);
  });
  expect_alarm(begin, 0.5, ResidualCause::payload);
}

// Loads come with 20 Hz, and after those of the twin.
TEST_F(JointResidualTest, LoadsThatTwinHasTooAreNoAlarm) {
  double load = 0;
  std::size_t count = 0;
  const auto described = [](double t) { return t > 20 && std::fmod(t, 1.43) < 0.7 ? 0.7 : 0.1; };
  run(120.0, moving, [&](double t, ResidualSample& sample) {
    sample.model_load = described(t);
    if (count++ % 5 == 0) load = described(t - kDelay) + sample.load - 0.2;
    sample.load = load;
  });
  EXPECT_EQ(residual_.alarms(), 0u) << to_string(residual_.alarm());
}

TEST_F(JointResidualTest, FiveDegreesOfOffsetAreSlippedHorn) {
  run(12.0, moving);
  const double begin = time_;
  run(1.0, moving, [](double, ResidualSample& sample) { sample.measured += 0.0873; });
  expect_alarm(begin, 0.5, ResidualCause::slipped_horn);
}

TEST_F(JointResidualWithSigma, SlipThatServoPullsBackIsSlippedHorn) {
  run(12.0, moving);
  const double begin = time_;
  run(1.0, moving, [&](double t, ResidualSample& sample) {
    sample.measured += std::max(0.0, 0.0873 - 3.0 * (t - begin));
  });
  ASSERT_GE(alarm_at_, begin);
  EXPECT_LE(alarm_at_, begin + 0.1);
}

// Six of eight samples repeat the one before them.
TEST_F(JointResidualTest, RepeatedReadingsThatCatchUpAreNoEvidence) {
  run(14, fast);
  double last = 0;
  int count = 0;
  run(20, fast, [&](double, ResidualSample& sample) {
    if (count++ % 8 >= 2) sample.measured = last;
    last = sample.measured;
  });
  EXPECT_EQ(residual_.alarms(), 0u) << to_string(residual_.alarm());
  EXPECT_LT(residual_.sigma(), 2 * kNoise);
}

TEST_F(JointResidualTest, OffsetFromStartIsSlippedHorn) {
  run(4.0, moving, [](double, ResidualSample& sample) { sample.measured += 0.6; });
  EXPECT_EQ(residual_.alarm(), ResidualCause::slipped_horn);
}

TEST_F(JointResidualTest, FallWithoutLoadIsLostPower) {
  run(12.0, moving);
  const double begin = time_;
  run(1.0, moving, [&](double t, ResidualSample& sample) {
    sample.load = 0;
    sample.measured -= 1.5 * (t - begin) * (t - begin);
  });
  expect_alarm(begin, 0.7, ResidualCause::lost_power);
}

TEST_F(JointResidualTest, MirroredMotionIsWrongDirection) {
  run(2.0, [](double) { return 0.0; });
  const double begin = time_;
  const auto path = [begin](double t) { return 0.5 * std::sin(1.3 * (t - begin)); };
  run(1.0, path, [](double, ResidualSample& sample) { sample.measured = -sample.measured; });
  expect_alarm(begin, 0.9, ResidualCause::wrong_direction);
}

TEST_F(JointResidualTest, AlarmEndsAfterSecondWithoutError) {
  run(12.0, moving);
  run(1.0, moving, [](double, ResidualSample& sample) { sample.measured += 0.2; });
  EXPECT_NE(residual_.alarm(), ResidualCause::none);
  run(1.5, moving);
  EXPECT_EQ(residual_.alarm(), ResidualCause::none);
  EXPECT_EQ(residual_.alarms(), 1u) << "one episode";
}

TEST_F(JointResidualTest, JointHeldBackByDriverIsNoAlarm) {
  run(12.0, moving);
  run(1.0, moving, [](double, ResidualSample& sample) {
    sample.measured -= 0.3;
    sample.held_back = true;
  });
  EXPECT_EQ(residual_.alarms(), 0u);
}

TEST_F(JointResidualTest, RestartForgetsAlarm) {
  run(12.0, moving);
  run(1.0, moving, [](double, ResidualSample& sample) { sample.measured += 0.2; });
  residual_.restart();
  EXPECT_EQ(residual_.alarm(), ResidualCause::none);
  EXPECT_TRUE(std::isnan(residual_.error()));
}

}  // namespace
}  // namespace doppel
