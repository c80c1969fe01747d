// The PID that closes the loop of velocity and effort commands.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/controllers/detail/pid.h"

namespace doppel {
namespace {

using testing::HasSubstr;

Pid with(const PidGains& gains) {
  EXPECT_TRUE(check_gains(gains).ok()) << check_gains(gains).why();
  Pid pid;
  pid.set_gains(gains);
  return pid;
}

TEST(Pid, OutputIsSumOfTerms) {
  PidGains gains;
  gains.p = 2, gains.i = 3, gains.d = 5;
  Pid pid = with(gains);
  EXPECT_DOUBLE_EQ(pid.compute(0.5, 0.1, 0.01), 2 * 0.5 + 3 * 0.5 * 0.01 + 5 * 0.1);
  EXPECT_DOUBLE_EQ(pid.compute(0.5, 0.1, 0.01), 2 * 0.5 + 3 * 0.5 * 0.02 + 5 * 0.1);
}

TEST(Pid, StrategyChoosesIntegrationOrder) {
  PidGains gains;
  gains.i = 1;
  EXPECT_DOUBLE_EQ(with(gains).compute(1, 0, 0.5), 0.5);
  for (const char* strategy : {"none", "conditional_integration", "back_calculation"}) {
    gains.antiwindup_strategy = strategy;
    Pid pid = with(gains);
    EXPECT_DOUBLE_EQ(pid.compute(1, 0, 0.5), 0.0) << strategy;
    EXPECT_DOUBLE_EQ(pid.compute(1, 0, 0.5), 0.5) << strategy;
  }
}

TEST(Pid, IntegralAndOutputAreClamped) {
  PidGains gains;
  gains.p = 1, gains.i = 10, gains.i_clamp_max = 0.3, gains.i_clamp_min = -0.1, gains.u_clamp_max = 1.2;
  Pid pid = with(gains);
  for (int n = 0; n < 10; ++n) pid.compute(1, 0, 0.1);
  EXPECT_DOUBLE_EQ(pid.integral(), 0.3);
  EXPECT_DOUBLE_EQ(pid.compute(1, 0, 0.1), 1.2);
  for (int n = 0; n < 10; ++n) pid.compute(-1, 0, 0.1);
  EXPECT_DOUBLE_EQ(pid.integral(), -0.1);
}

TEST(Pid, AntiWindupLimitsIntegral) {
  PidGains gains;
  gains.p = 1, gains.i = 1, gains.u_clamp_max = 1, gains.u_clamp_min = -1;
  const auto after_saturation = [&](const char* strategy) {
    gains.antiwindup_strategy = strategy;
    Pid pid = with(gains);
    for (int n = 0; n < 1000; ++n) pid.compute(10, 0, 0.01);
    return pid.integral();
  };
  EXPECT_NEAR(after_saturation("none"), 100, 1e-9);
  EXPECT_DOUBLE_EQ(after_saturation("conditional_integration"), 0);
  // Back-calculation settles where the clipped part balances the error: free output = 1 + i * error * T, T =
  // p / i.
  EXPECT_NEAR(after_saturation("back_calculation"), 1 + 10 - 10, 1e-2);
}

TEST(Pid, DeadbandStopsIntegration) {
  PidGains gains;
  gains.p = 1, gains.i = 1, gains.error_deadband = 0.1;
  Pid pid = with(gains);
  EXPECT_DOUBLE_EQ(pid.compute(0.1, 0, 1), 0.1);
  EXPECT_DOUBLE_EQ(pid.integral(), 0);
  pid.compute(0.2, 0, 1);
  EXPECT_DOUBLE_EQ(pid.integral(), 0.2);
}

// jtc.md, B11.
TEST(Pid, ResetClearsIntegral) {
  PidGains gains;
  gains.i = 1;
  Pid pid = with(gains);
  pid.compute(1, 0, 1);
  pid.set_gains(gains);
  EXPECT_DOUBLE_EQ(pid.integral(), 1);  // new gains preserve it
  pid.reset();
  EXPECT_DOUBLE_EQ(pid.integral(), 0);
}

TEST(Pid, InvalidInputsAreIgnored) {
  PidGains gains;
  gains.p = 1, gains.i = 1;
  Pid pid = with(gains);
  const double last = pid.compute(1, 0, 0.1);
  EXPECT_DOUBLE_EQ(pid.compute(5, 0, 0), last);
  EXPECT_TRUE(std::isnan(pid.compute(std::nan(""), 0, 0.1)));
  EXPECT_DOUBLE_EQ(pid.integral(), 0.1);
}

TEST(Pid, InvalidGainsAreRefused) {
  PidGains gains;
  gains.p = std::nan("");
  EXPECT_THAT(check_gains(gains).why(), HasSubstr("p is nan"));
  gains = {};
  gains.u_clamp_max = -1, gains.u_clamp_min = 1;
  EXPECT_THAT(check_gains(gains).why(), HasSubstr("u_clamp_min 1 is above u_clamp_max -1"));
  gains = {};
  gains.i_clamp_max = std::nan("");
  EXPECT_FALSE(check_gains(gains).ok());
  gains = {};
  gains.error_deadband = -1;
  EXPECT_FALSE(check_gains(gains).ok());
  gains = {};
  gains.antiwindup_strategy = "back_calculaton";
  EXPECT_THAT(check_gains(gains).why(), HasSubstr("did you mean 'back_calculation'"));
}

}  // namespace
}  // namespace doppel
