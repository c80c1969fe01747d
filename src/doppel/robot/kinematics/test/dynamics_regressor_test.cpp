#include "doppel/robot/kinematics/dynamics_regressor.h"

#include <gtest/gtest.h>

#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/kinematics/test/integrate.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

const Eigen::Vector3d kTilted(1.3, -2.1, -9.2);
const std::vector<JointType> kKinds = {JointType::revolute,   JointType::fixed,    JointType::planar,
                                       JointType::continuous, JointType::floating, JointType::prismatic};

Eigen::VectorXd random_rates(int size, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-2, 2);
  return Eigen::VectorXd::NullaryExpr(size, [&] { return unit(random); });
}

Eigen::VectorXd parameters_of(const Model& model) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(kInertialParameters * static_cast<int>(model.links.size()));
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    if (model.links[i].inertia)
      out.segment<kInertialParameters>(kInertialParameters * static_cast<Eigen::Index>(i)) =
          inertial_parameters(*model.links[i].inertia);
  }
  return out;
}

TEST(DynamicsRegressor, TimesParametersIsInverseDynamics) {
  const unsigned seed = 11;
  std::mt19937 random(seed);
  for (int round = 0; round < 60; ++round) {
    Diagnostics diagnostics;
    Model model = compile_model(test::make_random_chain(round % 2 == 0 ? kKinds : test::six_hinges(), random),
                                BaseKind::fixed, diagnostics);
    model.links[3].weightless = round % 3 == 0;
    Data data(model);
    const Eigen::VectorXd q = test::random_configuration(model, random);
    const Eigen::VectorXd v = random_rates(model.nv, random), a = random_rates(model.nv, random);
    Eigen::MatrixXd Y;
    dynamics_regressor(model, data, q, v, a, kTilted, Y);
    const Eigen::VectorXd tau = Y * parameters_of(model);
    inverse_dynamics(model, data, q, v, a, kTilted);
    EXPECT_LT((tau - data.tau).cwiseAbs().maxCoeff(), 1e-12 * (1 + data.tau.cwiseAbs().maxCoeff()))
        << "seed " << seed << " round " << round;
  }
}

TEST(InertialParameters, AreThoseOfSameBody) {
  std::mt19937 random(3);
  Diagnostics diagnostics;
  const Model model =
      compile_model(test::make_random_chain(test::six_hinges(), random), BaseKind::fixed, diagnostics);
  for (const ModelLink& link : model.links) {
    if (!link.inertia) continue;
    const MassProperties back = mass_properties(inertial_parameters(*link.inertia));
    EXPECT_NEAR(back.mass, link.inertia->mass, 1e-15);
    EXPECT_TRUE(back.com.isApprox(link.inertia->com, 1e-12));
    EXPECT_TRUE(back.I.isApprox(link.inertia->I, 1e-9));
  }
}

}  // namespace
}  // namespace doppel
