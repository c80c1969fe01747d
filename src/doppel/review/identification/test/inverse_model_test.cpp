#include "doppel/review/identification/inverse_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

#include "doppel/base/core/diagnostic.h"
#include "doppel/review/identification/detail/physical_bodies.h"
#include "doppel/review/identification/test/drawn_servo.h"
#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/kinematics/dynamics_regressor.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

using identification_detail::BodySpace;
using identification_detail::pseudo_inertia;
using ::testing::HasSubstr;

const Eigen::Vector3d kWeight(0, 0, -9.81);

Model compiled(const RobotDescription& robot) {
  Diagnostics diagnostics;
  return compile_model(robot, BaseKind::fixed, diagnostics);
}

// An arm of six hinges, and what a description of it says that is wrong by a third in each mass and place.
struct Arm {
  Model truth, described;
  std::vector<DriveLosses> losses, described_losses;
};

Arm arm_of(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  Arm out;
  out.truth = out.described = compiled(test::make_random_chain(test::six_hinges(), random));
  for (ModelLink& link : out.described.links) {
    if (!link.inertia) continue;
    link.inertia->mass *= std::exp(0.3 * unit(random));
    link.inertia->com += 0.02 * Eigen::Vector3d(unit(random), unit(random), unit(random));
    link.inertia->I *= std::exp(0.3 * unit(random));
  }
  for (int i = 0; i < 6; ++i) {
    out.losses.push_back(
        {0.002 + 0.001 * unit(random), 0.02 + 0.01 * unit(random), 0.03 + 0.01 * unit(random)});
    out.described_losses.push_back({0.001, 0.01, 0});
  }
  return out;
}

struct Measurement {
  double tick = 0, noise = 0;  // rad; N m, sigma of each effort
  double missing_inertia = 0;  // kg m^2, whose effort is not in the reading
};

// All joints move in harmonics for 40 s, at 100 Hz.
MeasuredMotion motion_of(const Arm& arm, unsigned seed, const Measurement& measurement) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::normal_distribution<double> normal;
  constexpr double kBase = 2 * 3.14159265358979 * 0.1;
  const int n = arm.truth.nv;
  Eigen::MatrixXd a(n, 5), b(n, 5);
  for (double& one : a.reshaped()) one = unit(random);
  for (double& one : b.reshaped()) one = unit(random);
  Data data(arm.truth);
  MeasuredMotion out;
  for (int i = 0; i < 4000; ++i) {
    const double t = 0.01 * i;
    Eigen::VectorXd q = Eigen::VectorXd::Zero(n), v = q, acc = q;
    for (int k = 1; k <= 5; ++k) {
      const double w = kBase * (k + 2), s = std::sin(w * t), c = std::cos(w * t);
      q += 0.35 * (a.col(k - 1) * s + b.col(k - 1) * c);
      v += 0.35 * w * (a.col(k - 1) * c - b.col(k - 1) * s);
      acc -= 0.35 * w * w * (a.col(k - 1) * s + b.col(k - 1) * c);
    }
    inverse_dynamics(arm.truth, data, q, v, acc, kWeight);
    for (int j = 0; j < n; ++j) {
      const DriveLosses& one = arm.losses[static_cast<std::size_t>(j)];
      const std::string& name = arm.truth.joints[static_cast<std::size_t>(j)].name;
      const double effort = data.tau[j] + (one.armature - measurement.missing_inertia) * acc[j] +
                            one.viscous * v[j] + std::copysign(one.friction, v[j]) +
                            measurement.noise * normal(random);
      const double position =
          measurement.tick > 0 ? std::round(q[j] / measurement.tick) * measurement.tick : q[j];
      out.measured[name].time.push_back(t);
      out.measured[name].position.push_back(position);
      out.efforts[name].time.push_back(t);
      out.efforts[name].position.push_back(effort);
    }
  }
  return out;
}

InverseModel fit_of(const Arm& arm, const MeasuredMotion& motion) {
  return fit_inverse_model(arm.described, torque_record(arm.described, motion), arm.described_losses,
                           kWeight);
}

Eigen::VectorXd true_combinations(const Arm& arm) {
  const BaseCombinations base = base_combinations(arm.described, {0, 1, 2, 3, 4, 5}, kWeight);
  Eigen::VectorXd p(base.B.cols());
  Eigen::Index i = 0;
  for (const int link : base.links) {
    p.segment<kInertialParameters>(i) =
        inertial_parameters(*arm.truth.links[static_cast<std::size_t>(link)].inertia);
    i += kInertialParameters;
  }
  for (const DriveLosses& one : arm.losses) {
    p.segment<3>(i) << one.armature, one.viscous, one.friction;
    i += 3;
  }
  return base.B * p;
}

double least_eigenvalue(const MassProperties& body) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(pseudo_inertia(inertial_parameters(body)))
      .eigenvalues()
      .minCoeff();
}

TEST(InverseModel, CombinationsPredictEffortsOfAllParameters) {
  const Arm arm = arm_of(1);
  const BaseCombinations base = base_combinations(arm.truth, {0, 1, 2, 3, 4, 5}, kWeight);
  // Gautier, Khalil 1990: 7 of each link of a hinge, 3 of the first one on a base that stands; 3 of each
  // drive, but for the first one's armature, which acts as the inertia of its link.
  EXPECT_EQ(base.B.rows(), 7 * 5 + 3 + 3 * 6 - 1);
  const Eigen::VectorXd b = true_combinations(arm);
  EXPECT_EQ(b.size(), base.B.rows());
}

TEST(InverseModel, RecoversExactArm) {
  const Arm arm = arm_of(2);
  const InverseModel fit = fit_of(arm, motion_of(arm, 2, {}));
  const Eigen::VectorXd truth = true_combinations(arm);
  ASSERT_EQ(static_cast<Eigen::Index>(fit.base.size()), truth.size());
  for (const TorqueErrors& one : fit.errors) {
    EXPECT_LT(one.base, 0.01 * one.effort) << one.joint;
    EXPECT_LT(one.physical, 0.01 * one.effort) << one.joint;
    EXPECT_GT(one.described, 10 * one.physical) << one.joint;
  }
  EXPECT_TRUE(fit.is_better());
}

TEST(InverseModel, IntervalsContainTruthUnderNoise) {
  int inside = 0, all = 0, identified = 0, right = 0;
  for (const unsigned seed : {3U, 4U, 5U, 6U}) {
    const Arm arm = arm_of(seed);
    const InverseModel fit = fit_of(arm, motion_of(arm, seed, {kTick4096, 0.02}));
    const Eigen::VectorXd truth = true_combinations(arm);
    for (std::size_t i = 0; i < fit.base.size(); ++i) {
      const BaseParameter& one = fit.base[i];
      const double value = truth[static_cast<Eigen::Index>(i)];
      const bool contains = one.low <= value && value <= one.high;
      inside += contains ? 1 : 0;
      ++all;
      if (one.verdict != BaseVerdict::identified) continue;
      ++identified;
      right += std::abs(one.value - value) < 0.35 * std::abs(one.value) ? 1 : 0;
    }
    for (const TorqueErrors& one : fit.errors) EXPECT_LT(one.physical, 0.5 * one.described) << one.joint;
  }
  EXPECT_GE(inside, 0.9 * all) << inside << " of " << all;
  EXPECT_GE(identified, 0.5 * all) << identified << " of " << all;
  EXPECT_GE(right, 0.97 * identified) << right << " of " << identified;
}

TEST(InverseModel, BodiesCanExist) {
  const Arm arm = arm_of(7);
  // Noise of the size of the efforts.
  const InverseModel fit = fit_of(arm, motion_of(arm, 7, {kTick4096, 0.3}));
  ASSERT_EQ(fit.links.size(), 6U);
  for (const FittedLink& link : fit.links) {
    EXPECT_GT(link.fitted.mass, 0);
    EXPECT_GT(least_eigenvalue(link.fitted), 0) << link.link;
  }
  for (const FittedDrive& drive : fit.drives) {
    EXPECT_GE(drive.fitted.armature, 0);
    EXPECT_GE(drive.fitted.viscous, 0);
    EXPECT_GE(drive.fitted.friction, 0);
  }
}

// Efforts that are sampled at one phase of a stiff drive's cycle lack a share of each acceleration: armatures
// below zero would explain them, and no body does.
TEST(InverseModel, BodiesStayPlausibleWhereNoneExplainsEfforts) {
  for (const unsigned seed : {7U, 9U, 11U}) {
    const Arm arm = arm_of(seed);
    const InverseModel fit = fit_of(arm, motion_of(arm, seed, {kTick4096, 0.001, 0.008}));
    for (const FittedLink& link : fit.links) {
      const double ratio = link.fitted.mass / link.described.mass;
      EXPECT_TRUE(ratio > 0.3 && ratio < 3) << "seed " << seed << ", link " << link.link << ": " << ratio;
    }
    for (const TorqueErrors& one : fit.errors) EXPECT_LT(one.physical, one.described) << one.joint;
  }
}

TEST(InverseModel, JointThatStandsIsNotExcited) {
  const Arm arm = arm_of(8);
  MeasuredMotion motion = motion_of(arm, 8, {kTick4096, 0.01});
  const std::string standing = arm.truth.joints[5].name;
  for (double& q : motion.measured[standing].position) q = 0.4;
  const InverseModel fit = fit_of(arm, motion);
  bool found = false;
  for (const BaseParameter& one : fit.base) {
    if (one.name != "friction of '" + standing + "'") continue;
    found = true;
    EXPECT_EQ(one.verdict, BaseVerdict::not_excited);
  }
  EXPECT_TRUE(found);
  EXPECT_FALSE(fit.drives[5].knows_friction);
}

TEST(InverseModel, RecordingWithoutEffortsIsRefused) {
  const Arm arm = arm_of(9);
  MeasuredMotion motion = motion_of(arm, 9, {});
  for (auto& [joint, curve] : motion.efforts) std::ranges::fill(curve.position, 0.0);
  try {
    static_cast<void>(torque_record(arm.described, motion));
    FAIL() << "accepted";
  } catch (const InputError& problem) {
    EXPECT_EQ(problem.diagnostics().front().rule, "identify.no_efforts");
    EXPECT_THAT(problem.what(), HasSubstr("the recording has no efforts"));
  }
}

TEST(BodySpace, ContainsDescribedBodyAndOnlyThoseThatCanExist) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-2, 2);
  const Model model = compiled(test::make_random_chain(test::six_hinges(), random));
  for (const ModelLink& link : model.links) {
    if (!link.inertia) continue;
    const InertialParameters described = inertial_parameters(*link.inertia);
    const BodySpace space(described);
    EXPECT_TRUE(space.at(InertialParameters::Zero()).isApprox(described, 1e-9));
    for (int i = 0; i < 50; ++i) {
      const InertialParameters place = InertialParameters::NullaryExpr([&] { return unit(random); });
      const InertialParameters body = space.at(place);
      EXPECT_GT(least_eigenvalue(mass_properties(body)), 0);
      const auto slope = space.slope(place);
      const InertialParameters step = 1e-5 * InertialParameters::NullaryExpr([&] { return unit(random); });
      EXPECT_LT((space.at(place + step) - body - slope * step).norm(), 1e-6 * (body.norm() + 1e-3));
    }
  }
}

}  // namespace
}  // namespace doppel
