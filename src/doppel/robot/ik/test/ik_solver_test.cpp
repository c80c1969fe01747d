// Inverse kinematics: solved, right, within limits, nearest, complete, and refused with the reason.
// Behaviours are those of planning.md; their sources are files of moveit2, branch jazzy.
#include "doppel/robot/ik/ik_solver.h"

#include <gtest/gtest.h>

#include <cstring>

#include "doppel/robot/ik/chain_jacobian.h"
#include "doppel/robot/ik/ik_failure.h"
#include "doppel/robot/ik/test/ik_robots.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {
namespace {

constexpr unsigned kSeed = 11;
constexpr int kPoses = 300;

struct NamedArm {
  const char* name;
  RobotDescription robot;
  IkMethod method;
};

std::vector<NamedArm> all_arms() {
  return {{"ur5e", test::ur5e(), IkMethod::exact},
          {"industrial", test::industrial(), IkMethod::exact},
          {"seven joints", test::seven_joints(), IkMethod::exact},
          {"five joints", test::five_joints(), IkMethod::exact},
          {"four joints", test::four_joints(), IkMethod::exact},
          {"ur5e from CAD", test::nearly(test::ur5e(), 5e-4, 2e-3), IkMethod::nearly_exact},
          {"industrial from CAD", test::nearly(test::industrial(), 1e-3, 2e-3), IkMethod::nearly_exact},
          {"five joints from CAD", test::nearly(test::five_joints(), 3e-4, 2e-3), IkMethod::nearly_exact},
          {"crooked", test::crooked(), IkMethod::numeric}};
}

double turn_difference(double a, double b) {
  return std::abs(std::remainder(a - b, 2 * M_PI));
}

// The tip by the whole model's forward kinematics.
Pose model_tip(const IkSolver& arm, const Eigen::VectorXd& u) {
  Data data(arm.model());
  Eigen::VectorXd q = arm.model().neutral();
  arm.chain().apply(arm.model(), u, q);
  forward_kinematics(arm.model(), data, q);
  return relative_pose(data, arm.chain().base_link, arm.chain().tip_link);
}

void expect_right(const IkSolver& arm, const IkRequest& request, const IkSolution& solution,
                  const char* name) {
  const Pose tip = model_tip(arm, solution.u);
  EXPECT_LT((tip.translation() - request.X_BT.translation()).norm(), 1e-6) << name;
  EXPECT_LT(Eigen::Quaterniond(tip.linear()).angularDistance(Eigen::Quaterniond(request.X_BT.linear())), 1e-6)
      << name;
  for (int i = 0; i < arm.chain().size(); ++i) {
    EXPECT_GE(solution.u[i], arm.chain().lower[i]) << name;
    EXPECT_LE(solution.u[i], arm.chain().upper[i]) << name;
  }
}

// B24, P6 (fanuc-kdl-singular.test.py): reachable poses are solved, none wrong, none outside of the limits.
TEST(IkSolver, EveryReachablePoseIsSolvedWithinLimits) {
  for (const NamedArm& named : all_arms()) {
    const IkSolver arm = test::solver_of(named.robot);
    EXPECT_EQ(arm.method(), named.method) << named.name << ": " << arm.about_method();
    std::mt19937 random(kSeed);
    for (int i = 0; i < kPoses; ++i) {
      IkRequest request;
      request.X_BT = tip_pose(arm.chain(), test::random_variables(arm.chain(), random));
      const auto solution = arm.solve(request);
      ASSERT_TRUE(solution) << named.name << ", pose " << i << " of seed " << kSeed;
      expect_right(arm, request, *solution, named.name);
    }
  }
}

// B24: poses in which the wrist or the elbow is singular.
TEST(IkSolver, SingularPosesAreSolved) {
  for (const NamedArm& named : all_arms()) {
    const IkSolver arm = test::solver_of(named.robot);
    std::mt19937 random(kSeed);
    for (int joint = 1; joint + 1 < arm.chain().size(); ++joint) {
      for (int i = 0; i < 20; ++i) {
        Eigen::VectorXd u = test::random_variables(arm.chain(), random);
        u[joint] = 0;
        IkRequest request;
        request.X_BT = tip_pose(arm.chain(), u);
        const auto solution = arm.solve(request);
        ASSERT_TRUE(solution) << named.name << ", joint " << joint << " at 0, pose " << i;
        expect_right(arm, request, *solution, named.name);
      }
    }
  }
}

// B23 (getIKMultipleSolutions, test_kinematics_plugin.cpp:661): the configuration that a pose was made from
// is among its branches, and no branch is there twice.
TEST(IkSolver, AllBranchesOfExactArmsContainOriginalConfiguration) {
  for (const NamedArm& named : all_arms()) {
    if (named.method == IkMethod::numeric || named.robot.name == "seven") continue;
    const IkSolver arm = test::solver_of(named.robot);
    std::mt19937 random(kSeed);
    int missed = 0;
    for (int i = 0; i < kPoses; ++i) {
      const Eigen::VectorXd u = test::random_variables(arm.chain(), random);
      IkRequest request;
      request.X_BT = tip_pose(arm.chain(), u);
      const std::vector<IkSolution> branches = arm.solve_all(request);
      const bool is_among = std::any_of(branches.begin(), branches.end(), [&u](const IkSolution& branch) {
        for (Eigen::Index k = 0; k < u.size(); ++k) {
          if (turn_difference(branch.u[k], u[k]) > 1e-4) return false;
        }
        return true;
      });
      missed += is_among ? 0 : 1;
      for (std::size_t a = 0; a < branches.size(); ++a) {
        expect_right(arm, request, branches[a], named.name);
        for (std::size_t b = 0; b < a; ++b)
          EXPECT_GT((branches[a].u - branches[b].u).norm(), 1e-4) << named.name;
      }
    }
    // Branches of a nearly exact arm that nearly meet may be refined to one of them.
    EXPECT_LE(missed, named.method == IkMethod::exact ? 0 : 1) << named.name << ", seed " << kSeed;
  }
}

// B22 (test_kinematics_plugin.cpp:342 randomWalkIK, :710 getNearestIKSolution): the solution is the one
// that is nearest to the seed, so that a path of near poses stays in one branch.
TEST(IkSolver, SolutionIsNearestToSeed) {
  for (const NamedArm& named : all_arms()) {
    const IkSolver arm = test::solver_of(named.robot);
    std::mt19937 random(kSeed);
    std::normal_distribution<double> step(0, 0.01);
    for (int i = 0; i < kPoses; ++i) {
      IkRequest request;
      request.seed = test::random_variables(arm.chain(), random);
      Eigen::VectorXd u = request.seed;
      for (double& x : u) x += step(random);
      u = u.cwiseMax(arm.chain().lower).cwiseMin(arm.chain().upper);
      request.X_BT = tip_pose(arm.chain(), u);
      const auto solution = arm.solve(request);
      ASSERT_TRUE(solution) << named.name;
      // Seven joints have infinitely many solutions, and the nearest is not searched for.
      if (arm.chain().size() > 6) {
        EXPECT_LT(solution->distance, 0.3) << named.name << ", pose " << i;
        continue;
      }
      const std::vector<IkSolution> all = arm.solve_all(request);
      EXPECT_LE(solution->distance, all.front().distance + 1e-6) << named.name << ", pose " << i;
      EXPECT_NEAR(solution->distance, (solution->u - request.seed).norm(), 1e-12);
    }
  }
}

// B25: of joints that turn more than once, the representative that is nearest to the seed.
TEST(IkSolver, JointWithSeveralTurnsStaysInSeedsTurn) {
  const IkSolver arm = test::solver_of(test::ur5e());
  IkRequest request;
  Eigen::VectorXd u(6);
  u << 4.5, -1.2, 1.1, -4.4, 0.8, 5.0;
  request.X_BT = tip_pose(arm.chain(), u);
  request.seed = u;
  EXPECT_LT(arm.solve(request)->distance, 1e-6);
  request.seed = u - Eigen::VectorXd::Unit(6, 5) * 2 * M_PI;
  EXPECT_NEAR(arm.solve(request)->u[5], 5.0 - 2 * M_PI, 1e-6);
}

TEST(IkSolver, ContinuousJointIsNeverMoreThanHalfTurnFromSeed) {
  RobotDescription robot = test::five_joints();
  robot.joints[4].type = JointType::continuous;
  robot.joints[4].limits.reset();
  const IkSolver arm = test::solver_of(robot);
  std::mt19937 random(kSeed);
  for (int i = 0; i < 50; ++i) {
    Eigen::VectorXd u = test::random_variables(arm.chain(), random);
    u[4] += 40 * M_PI;
    IkRequest request;
    request.X_BT = tip_pose(arm.chain(), u);
    request.seed = u;
    request.seed[4] += 3;
    const auto solution = arm.solve(request);
    ASSERT_TRUE(solution);
    EXPECT_NEAR(solution->u[4], u[4], 1e-5);
  }
}

// B27: arms with four and five joints get the whole pose where it is possible, and the position with the
// tool's axis where only that is.
TEST(IkSolver, FourJointsPointToolAndLeaveRotationAboutItFree) {
  const IkSolver arm = test::solver_of(test::four_joints());
  EXPECT_EQ(arm.task_space().freedom, 4);
  EXPECT_TRUE(arm.task_space().tool_axis.isApprox(Eigen::Vector3d::UnitZ()));
  IkRequest request;
  request.X_BT = make_pose({0.17, 0.14, 0.05}, {M_PI, 0, 0.3});  // down, turned by what no joint can set
  EXPECT_FALSE(arm.solve(request));
  request.task = IkTask::axis;
  const auto solution = arm.solve(request);
  ASSERT_TRUE(solution);
  const Pose tip = model_tip(arm, solution->u);
  EXPECT_LT((tip.translation() - request.X_BT.translation()).norm(), 1e-6);
  EXPECT_NEAR(tip.linear()(2, 2), -1, 1e-9);
  EXPECT_GT(solution->free_rotation, 0.1);
}

TEST(IkSolver, SlopeOfToolIsMetWhereItsDirectionCannotBe) {
  const IkSolver arm = test::solver_of(test::four_joints());
  IkRequest request;
  // Level, and across the way from the base: only the slope can be met.
  request.X_BT.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY()).matrix();
  request.X_BT.translation() = Eigen::Vector3d(0.3, 0, 0.15);
  request.task = IkTask::axis;
  EXPECT_FALSE(arm.solve(request));
  request.task = IkTask::angle;
  const auto solution = arm.solve(request);
  ASSERT_TRUE(solution);
  const Pose tip = model_tip(arm, solution->u);
  EXPECT_NEAR(tip.linear()(2, 2), 0, 1e-6);  // level
  EXPECT_LT((tip.translation() - request.X_BT.translation()).norm(), 1e-6);
}

// planning.md, decision 7: a pose for a small arm is answered within the tolerances of the request.
TEST(IkSolver, PoseWithinWideTolerancesIsFoundWhereExactOneIsNot) {
  const IkSolver arm = test::solver_of(test::five_joints());
  IkRequest request;
  request.X_BT.linear() =
      Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()) *
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX()).matrix();
  request.X_BT.translation() = Eigen::Vector3d(0.3, 0, 0.2);  // level, 0.1 rad beside the plane of the arm
  EXPECT_FALSE(arm.solve(request));
  request.rotation_tolerance = 0.05;
  EXPECT_FALSE(arm.solve(request));
  request.rotation_tolerance = 0.2;
  request.position_tolerance = 1e-4;
  const auto solution = arm.solve(request);
  ASSERT_TRUE(solution);
  EXPECT_LT(solution->rotation_error, 0.2);
  EXPECT_LT(solution->position_error, 1e-4);
}

TEST(TaskSpace, FreedomIsNumberOfJointsThatCount) {
  for (const NamedArm& named : all_arms()) {
    const IkSolver arm = test::solver_of(named.robot);
    EXPECT_EQ(arm.task_space().freedom, std::min(6, arm.chain().size())) << named.name;
  }
  // Three joints about one direction, and one more that is parallel to them: planar.
  const IkSolver planar = test::solver_of(test::arm_of("planar",
                                                       {{{0, 0, 0}, {0, 0, 0}, {0, 0, 1}},
                                                        {{0.2, 0, 0}, {0, 0, 0}, {0, 0, 1}},
                                                        {{0.2, 0, 0}, {0, 0, 0}, {0, 0, 1}},
                                                        {{0.2, 0, 0}, {0, 0, 0}, {0, 0, 1}}},
                                                       {0.1, 0, 0}));
  EXPECT_EQ(planar.task_space().freedom, 3);
  EXPECT_EQ(planar.task_space().task, IkTask::position);
}

TEST(IkSolver, RefusedSolutionsAreReplacedByOtherBranches) {
  const IkSolver arm = test::solver_of(test::industrial());
  std::mt19937 random(kSeed);
  IkRequest request;
  request.X_BT = tip_pose(arm.chain(), test::random_variables(arm.chain(), random));
  const std::vector<IkSolution> all = arm.solve_all(request);
  ASSERT_GE(all.size(), 2U);
  request.accepts = [&all](const Eigen::VectorXd& u) { return (u - all.front().u).norm() > 1e-3; };
  const auto other = arm.solve(request);
  ASSERT_TRUE(other);
  EXPECT_LT((other->u - all[1].u).norm(), 1e-6);
  request.accepts = [](const Eigen::VectorXd&) { return false; };
  EXPECT_FALSE(arm.solve(request));
  EXPECT_EQ(explain(arm, request).obstacle, IkObstacle::refused);
}

// Decision 9, P14: the same request gives the same bits.
TEST(IkSolver, SameRequestGivesSameBits) {
  for (const NamedArm& named : all_arms()) {
    std::mt19937 random(kSeed);
    const IkSolver one = test::solver_of(named.robot), two = test::solver_of(named.robot);
    IkRequest request;
    request.X_BT = tip_pose(one.chain(), test::random_variables(one.chain(), random));
    const Eigen::VectorXd first = one.solve(request)->u;
    for (int i = 0; i < 100; ++i) {
      const Eigen::VectorXd again = (i % 2 == 0 ? one : two).solve(request)->u;
      ASSERT_EQ(
          std::memcmp(first.data(), again.data(), static_cast<std::size_t>(first.size()) * sizeof(double)),
          0);
    }
  }
}

TEST(IkSolver, BatchSolvesEachPose) {
  for (const NamedArm& named : all_arms()) {
    const IkSolver arm = test::solver_of(named.robot);
    std::mt19937 random(kSeed);
    std::vector<Pose> targets;
    for (int i = 0; i < 1024; ++i)
      targets.push_back(tip_pose(arm.chain(), test::random_variables(arm.chain(), random)));
    targets.push_back(make_pose({9, 9, 9}, {0, 0, 0}));
    std::vector<std::optional<Eigen::VectorXd>> found;
    arm.solve_batch(targets, IkRequest{}, {}, found);
    ASSERT_EQ(found.size(), targets.size());
    EXPECT_FALSE(found.back());
    for (std::size_t i = 0; i + 1 < targets.size(); ++i) {
      ASSERT_TRUE(found[i]) << named.name << ", pose " << i;
      EXPECT_LT((tip_pose(arm.chain(), *found[i]).matrix() - targets[i].matrix()).norm(), 1e-5);
    }
  }
}

// "No is an answer": out of reach by how much.
TEST(IkFailure, DistanceOutOfReachIsThatOfStretchedArm) {
  const IkSolver arm = test::solver_of(test::four_joints());
  IkRequest request;
  request.task = IkTask::position;
  const double stretched = 0.14 + 0.14 + 0.1;  // from joint 2 on
  const Eigen::Vector3d shoulder(0, 0, 0.12), direction = Eigen::Vector3d(1, 0.4, 0.2).normalized();
  request.X_BT.translation() = shoulder + (stretched + 0.031) * direction;
  ASSERT_FALSE(arm.solve(request));
  const IkFailure failure = explain(arm, request);
  EXPECT_EQ(failure.obstacle, IkObstacle::out_of_reach);
  EXPECT_NEAR(failure.nearest.position_error, 0.031, 1e-5);
  EXPECT_EQ(describe(arm, request, failure), "the position is out of reach by 31 mm");
}

TEST(IkFailure, JointBeyondItsLimitIsNamedWithDegreesItLacks) {
  const IkSolver arm = test::solver_of(test::four_joints());
  IkRequest request;
  Eigen::VectorXd u(4);
  u << 2.6 + 0.2, 0.5, 0.6,
      0.3;  // 0.2 rad beyond the limit of joint 1; the other way round does not reach it either
  request.X_BT = tip_pose(arm.chain(), u);
  ASSERT_FALSE(arm.solve(request));
  const IkFailure failure = explain(arm, request);
  ASSERT_EQ(failure.obstacle, IkObstacle::limits);
  ASSERT_EQ(failure.limits.size(), 1U);
  EXPECT_EQ(variable_name(arm, failure.limits[0].variable), "joint1");
  EXPECT_NEAR(failure.limits[0].excess, 0.2, 1e-6);
  EXPECT_EQ(describe(arm, request, failure),
            "'joint1' would have to turn 11.5 deg beyond its upper limit of 149 deg");
}

TEST(IkFailure, NearestRotationAtReachedPositionIsLeast) {
  const IkSolver arm = test::solver_of(test::four_joints());
  IkRequest request;
  request.X_BT.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX()).matrix();
  request.X_BT.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()) * request.X_BT.linear();
  request.X_BT.translation() = Eigen::Vector3d(0.3, 0, 0.15);
  request.task = IkTask::axis;  // level, 0.4 rad out of the plane of the arm: no joint sets that
  ASSERT_FALSE(arm.solve(request));
  const IkFailure failure = explain(arm, request);
  EXPECT_EQ(failure.obstacle, IkObstacle::rotation);
  EXPECT_LT(failure.nearest.position_error, 1e-6);
  EXPECT_NEAR(failure.nearest.rotation_error, 0.4, 1e-3);
}

TEST(ChainJacobian, ColumnsAreDerivativesOfTip) {
  for (const NamedArm& named : all_arms()) {
    const IkSolver arm = test::solver_of(named.robot);
    std::mt19937 random(kSeed);
    const Eigen::VectorXd u = test::random_variables(arm.chain(), random);
    const auto J = chain_jacobian(arm.chain(), u);
    constexpr double h = 1e-6;
    for (int v = 0; v < arm.chain().size(); ++v) {
      const Eigen::VectorXd du = h * Eigen::VectorXd::Unit(u.size(), v);
      const Pose low = tip_pose(arm.chain(), u - du), high = tip_pose(arm.chain(), u + du);
      const Eigen::Matrix3d W =
          (high.linear() - low.linear()) / (2 * h) * tip_pose(arm.chain(), u).linear().transpose();
      EXPECT_LT((J.col(v).head<3>() - Eigen::Vector3d(W(2, 1), W(0, 2), W(1, 0))).norm(), 1e-8) << named.name;
      EXPECT_LT((J.col(v).tail<3>() - (high.translation() - low.translation()) / (2 * h)).norm(), 1e-8)
          << named.name;
    }
  }
}

TEST(ChainJacobian, StretchedArmIsSingular) {
  const IkSolver arm = test::solver_of(test::industrial());
  Eigen::VectorXd bent(6), straight_wrist(6);
  bent << 0.1, 0.3, 0.4, 0.5, 0.9, 0.2;
  straight_wrist << 0.1, 0.3, 0.4, 0.5, 0, 0.2;
  EXPECT_GT(manipulability(arm.chain(), bent, 6), 1e-3);
  EXPECT_LT(manipulability(arm.chain(), straight_wrist, 6), 1e-7);
  EXPECT_NEAR(limit_distance(arm.chain(), Eigen::VectorXd(arm.chain().upper)), 0, 1e-12);
}

}  // namespace
}  // namespace doppel
