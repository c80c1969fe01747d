// The kernels against the model's own kinematics, and against each other.
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "doppel/base/core/plugin_module.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/robot/kinematics/test/robots.h"
#include "doppel/robot/lanes/lane_program.h"

namespace doppel {
namespace {

Model random_model(const std::vector<JointType>& types, unsigned seed) {
  std::mt19937 random(seed);
  Diagnostics diagnostics;
  return compile_model(test::make_random_chain(types, random), BaseKind::fixed, diagnostics);
}

std::vector<JointType> mixed_joints(std::size_t count) {
  std::vector<JointType> out(count, JointType::continuous);
  for (std::size_t i = 2; i < count; i += 3) out[i] = JointType::prismatic;
  return out;
}

Eigen::VectorXd random_vector(int size, std::mt19937& random) {
  std::uniform_real_distribution<double> angle(-9, 9);
  return Eigen::VectorXd::NullaryExpr(size, [&] { return angle(random); });
}

TEST(Chain, TipPoseIsThatOfForwardKinematics) {
  std::mt19937 random(3);
  for (std::size_t count = 1; count < 12; ++count) {
    const Model model = random_model(mixed_joints(count), static_cast<unsigned>(count));
    const Chain chain = make_chain(model, 0, static_cast<int>(count));
    Data data(model);
    for (int i = 0; i < 20; ++i) {
      const Eigen::VectorXd q = random_vector(model.nq, random);
      forward_kinematics(model, data, q);
      const Pose difference = data.X_WL.back().inverse() * tip_pose(chain, chain.variables_of(model, q));
      EXPECT_LT((difference.matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-12) << count << " joints";
    }
  }
}

TEST(Chain, MimicJointFollowsItsLeaderWithNarrowerLimits) {
  std::mt19937 random(1);
  RobotDescription robot = test::make_random_chain({JointType::revolute, JointType::revolute}, random);
  test::limit(robot.joints[0], -1, 1, 1, 1);
  test::limit(robot.joints[1], -0.5, 3, 1, 1);
  robot.joints[1].mimic = Mimic{"joint0", 2.0, 0.1, {}};
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  const Chain chain = make_chain(model, 0, 2);
  ASSERT_EQ(chain.size(), 1);
  EXPECT_FALSE(chain.direct);
  EXPECT_DOUBLE_EQ(chain.lower[0], -0.3);  // 2 u + 0.1 >= -0.5
  EXPECT_DOUBLE_EQ(chain.upper[0], 1);
  Eigen::VectorXd q = model.neutral();
  chain.apply(model, Eigen::VectorXd::Constant(1, 0.4), q);
  EXPECT_DOUBLE_EQ(q[1], 0.9);
  Data data(model);
  forward_kinematics(model, data, q);
  EXPECT_TRUE(data.X_WL[2].isApprox(tip_pose(chain, Eigen::VectorXd::Constant(1, 0.4)), 1e-12));
}

TEST(Chain, TipThatIsNotBelowBaseIsRefused) {
  const Model model = random_model(mixed_joints(3), 1);
  EXPECT_THROW(make_chain(model, 3, 1), std::invalid_argument);
  EXPECT_THROW(make_chain(model, 1, 1), std::invalid_argument);  // nothing moves
}

// The kernels keep the joints of a chain in arrays.
TEST(Chain, MoreJointsThanKernelsHoldAreRefused) {
  std::mt19937 random(1);
  RobotDescription robot =
      test::make_random_chain(std::vector<JointType>(kMaxChainJoints + 1, JointType::continuous), random);
  for (std::size_t i = 1; i < robot.joints.size(); ++i) robot.joints[i].mimic = Mimic{"joint0", 1.0, 0.0, {}};
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  EXPECT_EQ(make_chain(model, 0, kMaxChainJoints).joints.size(), std::size_t{kMaxChainJoints});
  EXPECT_THROW(make_chain(model, 0, kMaxChainJoints + 1), std::invalid_argument);
}

TEST(Chain, LinksAreMovedByJointsAboveThem) {
  const Model model = random_model(mixed_joints(4), 1);
  const std::vector<std::uint32_t> bits = moving_variables(model, make_chain(model, 1, 3));
  EXPECT_EQ(bits, (std::vector<std::uint32_t>{0, 0, 1, 3, 3}));
}

TEST(LaneKernels, TipPosesAreThoseOfChain) {
  std::mt19937 random(5);
  for (std::size_t count : {1UL, 4UL, 7UL, 20UL}) {
    const Model model = random_model(mixed_joints(count), static_cast<unsigned>(count));
    const Chain chain = make_chain(model, 0, static_cast<int>(count));
    const LaneProgram program(chain);
    constexpr int kStates = 21;  // no multiple of the lanes
    std::vector<double> u, poses(kStates * 12);
    for (int i = 0; i < kStates; ++i) {
      const Eigen::VectorXd state = random_vector(chain.size(), random);
      u.insert(u.end(), state.begin(), state.end());
    }
    lane_kernels().tip_poses(program.chain(), u.data(), kStates, poses.data());
    for (int i = 0; i < kStates; ++i) {
      double expected[12];
      const auto state =
          Eigen::Map<const Eigen::VectorXd>(&u[static_cast<std::size_t>(i * chain.size())], chain.size());
      to_numbers(tip_pose(chain, state), expected);
      for (int k = 0; k < 12; ++k)
        EXPECT_NEAR(poses[static_cast<std::size_t>(i * 12 + k)], expected[k], 1e-12);
    }
  }
}

// planning.md P14: the same bits on all widths of registers.
TEST(LaneKernels, AllInstructionSetsGiveSameBits) {
  for (const std::size_t count : {3UL, 4UL, 5UL, 6UL, 7UL, 9UL}) {
    const Model model = random_model(mixed_joints(count), 40 + static_cast<unsigned>(count));
    const Chain chain = make_chain(model, 0, static_cast<int>(count));
    const LaneProgram program(chain);
    std::mt19937 random(7);
    constexpr int kTargets = 50, kStarts = 20;
    std::vector<double> targets(kTargets * 12), starts;
    for (int i = 0; i < kTargets; ++i)
      to_numbers(tip_pose(chain, random_vector(chain.size(), random)),
                 &targets[static_cast<std::size_t>(i) * 12]);
    for (int i = 0; i < kStarts; ++i) {
      const Eigen::VectorXd start = random_vector(chain.size(), random);
      starts.insert(starts.end(), start.begin(), start.end());
    }
    for (const bool nearest : {false, true}) {
      std::vector<std::vector<double>> results;
      for (const std::string& module : modules_for_processor("doppel_lane_kernels")) {
        const std::size_t results_count = kTargets * (nearest ? kStarts : 1);
        std::vector<double> q(results_count * count), residuals(results_count * 2);
        std::vector<int> attempt(results_count);
        LaneSearch search{};
        search.chain = &program.chain();
        search.targets = targets.data();
        search.target_count = kTargets;
        search.starts = starts.data();
        search.start_count = kStarts;
        search.max_iterations = 16;
        search.position_tolerance = search.rotation_tolerance = 1e-9;
        search.length = chain.length;
        search.rotation_weight = 1;
        search.every_attempt = search.nearest = nearest;
        search.q = q.data();
        search.attempt = attempt.data();
        search.residuals = residuals.data();
        lane_kernels(module.c_str()).search(search);
        q.insert(q.end(), residuals.begin(), residuals.end());
        q.insert(q.end(), attempt.begin(), attempt.end());
        results.push_back(std::move(q));
      }
      for (const std::vector<double>& other : results)
        EXPECT_EQ(std::memcmp(other.data(), results[0].data(), other.size() * sizeof(double)), 0)
            << count << " joints";
    }
  }
}

}  // namespace
}  // namespace doppel
