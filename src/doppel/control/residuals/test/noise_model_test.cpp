#include "doppel/control/residuals/detail/noise_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace doppel {
namespace {

class NoiseModelTest : public testing::Test {
 protected:
  // Errors with the standard deviation hypot(s, c x) and x to 2.
  void learn(double s, double c, int count) {
    std::uniform_real_distribution<double> speed(0.0, 2.0);
    std::normal_distribution<double> unit;
    for (int i = 0; i < count; ++i) {
      const double x = speed(random_);
      model_.learn(std::hypot(s, c * x) * unit(random_), x);
    }
  }
  std::mt19937_64 random_{3};
  NoiseModel model_{{.s = 0.01, .c = 0.003, .least = 0.0005}};
};

TEST_F(NoiseModelTest, StartIsThatOfOptions) {
  EXPECT_NEAR(model_.sigma(0), 0.01, 1e-12);
  EXPECT_NEAR(model_.sigma(1), std::hypot(0.01, 0.003), 1e-12);
}

TEST_F(NoiseModelTest, BothPartsAreLearned) {
  learn(0.002, 0.003, 20000);
  EXPECT_NEAR(model_.sigma(0), 0.002, 0.0003);
  EXPECT_NEAR(model_.sigma(2), std::hypot(0.002, 0.006), 0.0006);
}

TEST_F(NoiseModelTest, ConstantNoiseDoesNotGrowWithSpeed) {
  learn(0.002, 0, 20000);
  EXPECT_NEAR(model_.sigma(0), 0.002, 0.0002);
  EXPECT_NEAR(model_.sigma(2), 0.002, 0.0002);
}

TEST_F(NoiseModelTest, NoiseOfSpeedAloneIsNoneAtRest) {
  learn(0, 0.003, 20000);
  EXPECT_LT(model_.sigma(0), 0.001);
  EXPECT_NEAR(model_.sigma(2), 0.006, 0.0006);
}

TEST_F(NoiseModelTest, SigmaIsNeverBelowLeast) {
  learn(0, 0, 100000);
  EXPECT_DOUBLE_EQ(model_.sigma(0), 0.0005);
}

TEST_F(NoiseModelTest, LargeErrorsCountAsModerateOnes) {
  learn(0.002, 0, 5000);
  for (int i = 0; i < 50; ++i) model_.learn(1.0, 1.0);
  EXPECT_LT(model_.sigma(0), 0.0025);
}

TEST_F(NoiseModelTest, OldErrorsAreForgotten) {
  learn(0.004, 0, 30000);
  learn(0.001, 0, 150000);
  EXPECT_NEAR(model_.sigma(0), 0.001, 0.0002);
}

}  // namespace
}  // namespace doppel
