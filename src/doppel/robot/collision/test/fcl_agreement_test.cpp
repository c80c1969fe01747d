// Whole robots in random states, compared with FCL. bench_collision does the same with 10,000 states of each.
#include <gtest/gtest.h>

#include "doppel/robot/collision/test/fcl_reference.h"

namespace doppel {
namespace {

constexpr int kStates = 200;
constexpr unsigned kSeed = 61;

class FclAgreement : public testing::TestWithParam<const char*> {};

TEST_P(FclAgreement, DistancesAreEqualAndTouchingIsNeverFree) {
  SCOPED_TRACE("seed 61");
  const test::CollidingRobot robot =
      test::load_colliding(GetParam(), std::filesystem::path(DOPPEL_SOURCE_DIR) / "robots");
  CollisionContext context(robot.scene);
  const test::FclReference fcl(robot.scene->instances()[0].shapes);
  Data data(*robot.model);
  std::mt19937_64 random(kSeed);
  ASSERT_FALSE(robot.scene->tested_pairs().empty());
  for (int state = 0; state < kStates; ++state) {
    const Eigen::VectorXd q = test::random_state(*robot.model, random);
    forward_kinematics(*robot.model, data, q);
    context.set_configuration(0, q);
    double nearest = kFarAway;
    bool touching = false;
    for (const auto& [a, b] : robot.scene->tested_pairs()) {
      const double distance = context.distance(a, b).distance;
      const std::string pair = robot.model->links[static_cast<std::size_t>(a.link)].name + " and " +
                               robot.model->links[static_cast<std::size_t>(b.link)].name;
      if (fcl.touch(a.link, b.link, data.X_WL)) {
        touching = true;
        ASSERT_TRUE(context.closer(a, b, kTouching)) << pair << ", state " << state;
      } else {
        ASSERT_NEAR(std::max(distance, 0.0), fcl.distance(a.link, b.link, data.X_WL), 1e-4)
            << pair << ", state " << state;
      }
      nearest = std::min(nearest, distance);
    }
    ASSERT_NEAR(context.distance().distance, nearest, 1e-7) << "state " << state;
    if (touching) {
      ASSERT_TRUE(context.in_collision()) << "state " << state;
    }
    ASSERT_EQ(context.in_collision(), nearest < kTouching) << "state " << state;
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, FclAgreement,
                         testing::Values("omarm_one", "omarm_zero", "lab_arm", "kate", "turtle", "rover_skid",
                                         "rover_mecanum", "ackermann_car"),
                         [](const auto& robot) { return std::string(robot.param); });

}  // namespace
}  // namespace doppel
