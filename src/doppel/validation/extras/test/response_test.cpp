// X2 beside the closed form of a servo.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "doppel/validation/extras/detail/servo_response.h"
#include "doppel/validation/extras/response_extra.h"
#include "extra_robots.h"

namespace doppel {
namespace {

constexpr double kPlateInertia = 0.05;  // kg m^2

std::string turning_plate() {
  return R"(<robot name="plate"><link name="base_link"/>)" + bar_link("plate", 1, 0, kPlateInertia) +
         hinge_text({.name = "turn",
                     .parent = "base_link",
                     .child = "plate",
                     .axis = "0 0 1",
                     .effort = 200,
                     .velocity = 20}) +
         "</robot>";
}

TEST(FrequencyResponseExtra, ServoModelIsSpringAndDamper) {
  const WrittenRobot robot(turning_plate());
  const ServoResponse model(robot.subject(), robot.subject().model->neutral());
  const ServoParameters& servo = robot.subject().robot().servos().front();
  for (const double frequency : {0.5, 5.0, 15.0}) {
    const std::complex<double> s(0, 2 * std::numbers::pi * frequency);
    const std::complex<double> expected =
        (servo.stiffness + servo.damping * s) / (kPlateInertia * s * s + servo.damping * s + servo.stiffness);
    EXPECT_NEAR(std::abs(model.at_frequency("turn", frequency, 0) - expected), 0, 1e-12);
  }
}

TEST(FrequencyResponseExtra, TwinFollowsServoModel) {
  const WrittenRobot robot(turning_plate());
  const CheckResult result = check_frequency_response(robot.context());
  EXPECT_EQ(result.verdict, Verdict::passed);
  ASSERT_EQ(result.items.size(), 1U) << result.summary;
  for (const Metric& metric : result.metrics) {
    if (metric.name == "difference from the servo model") {
      EXPECT_LT(metric.value, 1);
    }
    if (metric.name == "phase difference from the servo model") {
      EXPECT_LT(metric.value, 5);
    }
  }
  EXPECT_EQ(result.items.front().curves.size(), 2U);
}

}  // namespace
}  // namespace doppel
