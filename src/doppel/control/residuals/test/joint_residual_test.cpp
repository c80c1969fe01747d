#include "doppel/control/residuals/joint_residual.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace doppel {
namespace {

constexpr double kStep = 0.01;
constexpr double kNoise = 0.0015;  // rad, a tick of 4096

double moving(double t) {
  return 0.5 * std::sin(1.3 * t) + 0.2 * std::sin(3.1 * t);
}

// The joint of a twin moves as `twin(t)`; that of the hardware follows 47 ms later, with noise.
class JointResidualTest : public testing::Test {
 protected:
  using Path = std::function<double(double)>;
  using Change = std::function<void(double t, ResidualSample&)>;
  static constexpr double kDelay = 0.047;

  void run(double seconds, const Path& twin, const Change& change = {}) {
    std::normal_distribution noise(0.0, kNoise);
    const double end = time_ + seconds;
    for (; time_ < end; time_ += kStep) {
      ResidualSample sample{twin(time_ - kDelay) + noise(random_), twin(time_), 0.2, 0.2, false};
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
  JointResidualWithSigma() { residual_ = JointResidual({.sigma = 2 * kNoise}); }
};

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

TEST_F(JointResidualTest, BlockedJointIsStall) {
  run(13.0, moving);
  const double begin = time_, still = moving(begin);
  run(1.0, moving, [&](double, ResidualSample& sample) {
    sample.measured = still;
    sample.load = 0.9;
  });
  expect_alarm(begin, 0.8, ResidualCause::stall);
}

TEST_F(JointResidualWithSigma, BlockedJointIsStallWithinHalfSecond) {
  run(13.0, moving);
  const double begin = time_, still = moving(begin);
  run(1.0, moving, [&](double, ResidualSample& sample) {
    sample.measured = still;
    sample.load = 0.9;
  });
  expect_alarm(begin, 0.5, ResidualCause::stall);
}

TEST_F(JointResidualWithSigma, WeightIsPayload) {
  run(12.0, moving);
  const double begin = time_;
  run(1.0, moving, [&](double t, ResidualSample& sample) {
    sample.load += 0.12;
    sample.measured -= 0.03 * (1 - std::exp(-(t - begin) / 0.08));
  });
  expect_alarm(begin, 0.5, ResidualCause::payload);
}

TEST_F(JointResidualTest, FiveDegreesOfOffsetAreSlippedHorn) {
  run(12.0, moving);
  const double begin = time_;
  run(1.0, moving, [](double, ResidualSample& sample) { sample.measured += 0.0873; });
  expect_alarm(begin, 0.5, ResidualCause::slipped_horn);
}

TEST_F(JointResidualTest, LateSamplesThatCatchUpAreNoAlarm) {
  const auto fast = [](double t) { return 0.8 * std::sin(3.5 * t); };  // 2.8 rad/s
  run(14, fast);
  double last = 0;
  int late = 0;
  run(20, fast, [&](double t, ResidualSample& sample) {
    // Six samples of each second repeat the one before them.
    if (std::fmod(t, 1.0) >= 0.5 && std::fmod(t, 1.0) < 0.56) {
      sample.measured = last;
      ++late;
    }
    last = sample.measured;
  });
  EXPECT_GT(late, 100);
  EXPECT_EQ(residual_.alarms(), 0u) << to_string(residual_.alarm());
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
