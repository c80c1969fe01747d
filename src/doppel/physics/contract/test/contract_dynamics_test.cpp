// The contract for every engine: bodies move according to the laws of mechanics.

#include <cmath>
#include <numbers>
#include <random>

#include "contract_rig.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel::test {
namespace {

class DynamicsContract : public Contract {};
DOPPEL_FOR_EVERY_ENGINE(DynamicsContract);

// The period of the mathematical pendulum, to second order in the amplitude.
TEST_P(DynamicsContract, PendulumSwingsWithItsPeriod) {
  const double mass = 1.0, length = 0.5, amplitude = 0.2;
  const auto engine = make(settings(), {robot(make_pendulum(mass, length))});
  set(engine->instance(0), {amplitude});
  const double inertia = mass * length * length + 1e-6;
  const double a2 = amplitude * amplitude;
  const double period = 2 * std::numbers::pi * std::sqrt(inertia / (mass * kGravity * length)) *
                        (1 + a2 / 16 + 11 * a2 * a2 / 3072);
  std::vector<double> crossings;
  double before = amplitude;
  while (crossings.size() < 11 && engine->time() < time_from_seconds(30)) {
    const double t = to_seconds(engine->time());
    engine->step();
    const double now = engine->instance(0).q()[0];
    if (before > 0 && now <= 0) crossings.push_back(t + 1e-3 * before / (before - now));
    before = now;
  }
  ASSERT_EQ(crossings.size(), 11u);
  EXPECT_NEAR((crossings.back() - crossings.front()) / 10 / period, 1.0, within().period);
}

TEST_P(DynamicsContract, FreeBodyFallsWithGravity) {
  if (!can().floating) GTEST_SKIP() << "the engine has no floating bodies";
  const auto engine = make(settings(), {object("ball", Sphere{0.1}, at(0, 0, 10), 2.0)});
  run(*engine, 1.0);
  // Semi-implicit Euler falls g h t / 2 more.
  const double fallen = 10 - engine->instance(0).base_pose().translation().z();
  EXPECT_NEAR(fallen, 0.5 * kGravity * (1.0 + 1e-3), within().free_fall);
}

TEST_P(DynamicsContract, AccelerationsMatchIndependentDynamics) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<JointType> types = six_hinges();
  types[2] = JointType::prismatic;
  for (int round = 0; round < 20; ++round) {
    InstanceOptions options;
    options.X_WR = make_pose({0.3, -0.2, 0.1}, {unit(random), unit(random), unit(random)});
    const double h = 1e-6;
    const auto engine = make(settings(h), {robot(make_random_chain(types, random), options)});
    Instance chain = engine->instance(0);
    const Model& model = chain.model();
    const Eigen::VectorXd q = Eigen::VectorXd::NullaryExpr(model.nq, [&] { return unit(random); });
    const Eigen::VectorXd v = Eigen::VectorXd::NullaryExpr(model.nv, [&] { return 3 * unit(random); });
    set(chain, copy({q.data(), 6}), copy({v.data(), 6}));
    Data data(model);
    const Eigen::Vector3d gravity = options.X_WR.linear().transpose() * Eigen::Vector3d(0, 0, -kGravity);
    inverse_dynamics(model, data, q, v, Eigen::VectorXd::Zero(6), gravity);
    const Eigen::VectorXd bias = data.tau;
    mass_matrix(model, data, q);
    const Eigen::VectorXd expected = data.M.ldlt().solve(-bias);
    engine->step();
    const Eigen::VectorXd seen = (vector(chain.v()) - v) / h;
    EXPECT_LT((seen - expected).norm(), 2e-3 * expected.norm()) << "round " << round;
  }
}

TEST_P(DynamicsContract, LinkPosesMatchForwardKinematics) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  RobotDescription description = make_random_chain(six_hinges(), random);
  Link tip = make_frame("tip");
  description.links.push_back(tip);
  Joint weld = make_joint("weld", JointType::fixed, "link5", "tip", {0.1, 0.2, 0.3}, {1, 0, 0});
  weld.origin.rpy = {0.4, 0.5, 0.6};
  description.joints.push_back(weld);
  InstanceOptions options;
  options.X_WR = make_pose({1, 2, 3}, {0.1, 0.2, 0.3});
  const auto engine = make(settings(), {robot(description, options)});
  Instance chain = engine->instance(0);
  const Model& model = chain.model();
  Data data(model);
  for (int round = 0; round < 10; ++round) {
    const Eigen::VectorXd q = Eigen::VectorXd::NullaryExpr(model.nq, [&] { return 3 * unit(random); });
    const Eigen::VectorXd v = Eigen::VectorXd::NullaryExpr(model.nv, [&] { return unit(random); });
    set(chain, copy({q.data(), 6}), copy({v.data(), 6}));
    forward_kinematics(model, data, q);
    for (int link = 0; link < static_cast<int>(model.links.size()); ++link) {
      const Pose expected = options.X_WR * data.X_WL[static_cast<std::size_t>(link)];
      EXPECT_TRUE(chain.link_pose(link).isApprox(expected, 1e-12))
          << model.links[static_cast<std::size_t>(link)].name;
      Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model.nv);
      jacobian(model, data, link, Eigen::Vector3d::Zero(), J);
      const Eigen::VectorXd V = J * v;
      EXPECT_LT((chain.link_velocity(link).linear_W - options.X_WR.linear() * V.tail<3>()).norm(), 1e-11);
      EXPECT_LT((chain.link_velocity(link).angular_W - options.X_WR.linear() * V.head<3>()).norm(), 1e-11);
    }
  }
}

TEST_P(DynamicsContract, FloatingRobotFallsAsOneBody) {
  if (!can().floating) GTEST_SKIP() << "the engine has no floating bodies";
  std::mt19937 random(5);
  RobotDescription description = make_random_chain(six_hinges(), random);
  description.links.front() = random_link("base", random);
  InstanceOptions options;
  options.X_WR = make_pose({0, 0, 5}, {0.3, -0.4, 0.5});
  const auto engine = make(settings(1e-4), {robot(description, options, BaseKind::floating)});
  Instance of = engine->instance(0);
  std::vector<double> v(static_cast<std::size_t>(of.model().nv), 0.0);
  for (std::size_t i = 6; i < v.size(); ++i) v[i] = 2.0 - static_cast<double>(i) / 3;
  of.set_state(copy(of.q()), v);
  const auto centre = [&] {
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    for (int link = 0; link < static_cast<int>(of.model().links.size()); ++link) {
      const auto& inertia = of.model().links[static_cast<std::size_t>(link)].inertia;
      if (inertia) out += inertia->mass * (of.link_pose(link) * inertia->com);
    }
    return Eigen::Vector3d(out / of.model().total_mass);
  };
  const auto momentum = [&] {
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    for (int link = 0; link < static_cast<int>(of.model().links.size()); ++link) {
      const auto& inertia = of.model().links[static_cast<std::size_t>(link)].inertia;
      if (!inertia) continue;
      const FrameVelocity at = of.link_velocity(link);
      out += inertia->mass * (at.linear_W + at.angular_W.cross(of.link_pose(link).linear() * inertia->com));
    }
    return out;
  };
  const Eigen::Vector3d from = centre(), rate = momentum() / of.model().total_mass;
  run(*engine, 0.3);
  const Eigen::Vector3d fallen =
      from + 0.3 * rate + Eigen::Vector3d(0, 0, -0.5 * kGravity * 0.3 * (0.3 + 1e-4));
  EXPECT_LT((centre() - fallen).norm(), 2e-4);
}

TEST_P(DynamicsContract, TumblingBodyKeepsItsAngularMomentum) {
  if (!can().floating) GTEST_SKIP() << "the engine has no floating bodies";
  WorldSettings in = settings(1e-4);
  in.gravity.setZero();
  const auto engine = make(in, {object("brick", Box{{0.1, 0.2, 0.4}}, at(0, 0, 1), 1.0)});
  Instance brick = engine->instance(0);
  brick.set_base_velocity({{0, 0, 0}, {0.3, 4.0, 0.2}});  // about the middle axis, which is unstable
  const Eigen::Vector3d moments = Eigen::Vector3d(0.04 + 0.16, 0.01 + 0.16, 0.01 + 0.04) / 12;
  const auto momentum = [&] {
    const Eigen::Matrix3d R = brick.base_pose().linear();
    return Eigen::Vector3d(R * moments.cwiseProduct(R.transpose() * brick.base_velocity().angular_W));
  };
  const Eigen::Vector3d before = momentum();
  run(*engine, 2.0);
  EXPECT_LT((momentum() - before).norm(), 0.01 * before.norm());
}

// A plate that spins about its middle axis at 10 rad/s, at the default step: its flips are those of Euler's
// equations, which the test integrates by itself, and nothing feeds it.
TEST_P(DynamicsContract, TumblingBodyKeepsItsEnergyAtDefaultStep) {
  if (!can().floating) GTEST_SKIP() << "the engine has no floating bodies";
  if (GetParam() == "analytic") GTEST_SKIP() << "the reference engine has an explicit gyroscopic term";
  WorldSettings in = settings();
  in.gravity.setZero();
  const Eigen::Vector3d moments =
      Eigen::Vector3d(0.2 * 0.2 + 0.05 * 0.05, 0.3 * 0.3 + 0.05 * 0.05, 0.3 * 0.3 + 0.2 * 0.2) / 12;
  const Eigen::Vector3d start(0.05, 10, 0.02);
  const auto engine = make(in, {object("plate", Box{{0.3, 0.2, 0.05}}, at(0, 0, 1), 1.0)});
  Instance plate = engine->instance(0);
  plate.set_base_velocity({{0, 0, 0}, start});
  const auto turning = [&] {
    return Eigen::Vector3d(plate.base_pose().linear().transpose() * plate.base_velocity().angular_W);
  };
  const auto slope = [&](const Eigen::Vector3d& w) {
    return Eigen::Vector3d(-w.cross(moments.cwiseProduct(w)).cwiseQuotient(moments));
  };
  Eigen::Vector3d exact = start;
  const double energy = 0.5 * start.dot(moments.cwiseProduct(start)),
               momentum = moments.cwiseProduct(start).norm();
  int flips = 0, exact_flips = 0;
  for (int i = 0; i < 20000; ++i) {
    const double before = turning().y(), exact_before = exact.y();
    engine->step();
    const double h = 1e-3;
    const Eigen::Vector3d a = slope(exact), b = slope(exact + 0.5 * h * a), c = slope(exact + 0.5 * h * b),
                          d = slope(exact + h * c);
    exact += h / 6 * (a + 2 * b + 2 * c + d);
    flips += before * turning().y() < 0 ? 1 : 0;
    exact_flips += exact_before * exact.y() < 0 ? 1 : 0;
  }
  const Eigen::Vector3d end = turning();
  EXPECT_NEAR(0.5 * end.dot(moments.cwiseProduct(end)), energy, 1e-6 * energy);
  EXPECT_NEAR(moments.cwiseProduct(end).norm(), momentum, 1e-6 * momentum);
  EXPECT_GT(exact_flips, 5);
  EXPECT_EQ(flips, exact_flips);
}

TEST_P(DynamicsContract, DampingOfFloatingJointSlowsIt) {
  if (!can().floating) GTEST_SKIP() << "the engine has no floating bodies";
  RobotDescription description;
  description.name = "float";
  description.links = {make_frame("world"), make_link("body", 2.0, {0.1, 0, 0}, {0.1, 0.1, 0.1})};
  description.joints = {make_joint("free", JointType::floating, "world", "body", {0, 0, 0}, {1, 0, 0})};
  description.joints[0].dynamics = JointDynamics{0.5, 0.0, {}};
  WorldSettings in = settings(1e-4);
  in.gravity.setZero();
  const auto engine = make(in, {robot(description)});
  Instance of = engine->instance(0);
  // About the axis through the centre of mass, so that the origin does not move.
  of.set_base_velocity({{0, 0, 0}, {2.0, 0, 0}});
  run(*engine, 0.2);
  EXPECT_NEAR(of.base_velocity().angular_W.x(), 2.0 * std::exp(-0.5 * 0.2 / 0.1), 2e-3);
}

// An engine moves it, or reports by name that it cannot; nothing is left out silently.
TEST_P(DynamicsContract, FloatingJointOnMovingLinkFallsOrIsRefused) {
  if (!can().floating) GTEST_SKIP() << "the engine has no floating bodies";
  RobotDescription description;
  description.name = "lift";
  description.links = {make_frame("rail"), make_link("cabin", 5.0, {0, 0, 0}, {1, 1, 1}),
                       make_link("ball", 1.0, {0, 0, 0}, {0.1, 0.1, 0.1})};
  description.joints = {make_joint("shaft", JointType::prismatic, "rail", "cabin", {0, 0, 3}, {0, 0, 1}),
                        make_joint("loose", JointType::floating, "cabin", "ball", {0, 0, 0}, {1, 0, 0})};
  limit(description.joints[0], -1, 1, 1000, 1);
  try {
    const auto engine = make(settings(), {robot(description)});
    engine->instance(0).set_drive(0, DriveMode::position);
    run(*engine, 0.1);
    EXPECT_LT(engine->instance(0).link_pose(2).translation().z(), 2.96);
  } catch (const InputError& error) {
    EXPECT_EQ(GetParam(), "bullet");
    EXPECT_NE(std::string(error.what()).find("'loose'"), std::string::npos) << error.what();
  }
}

TEST_P(DynamicsContract, EnergyIsConservedWithoutDissipation) {
  const auto engine = make(settings(1e-4), {robot(make_double_pendulum(1.0, 0.3, 0.5, 0.4))});
  set(engine->instance(0), {1.0, 0.5});
  const double before = engine->kinetic_energy() + engine->potential_energy();
  EXPECT_EQ(engine->kinetic_energy(), 0.0);
  run(*engine, 0.4);
  EXPECT_GT(engine->kinetic_energy(), 0.5);
  EXPECT_NEAR(engine->kinetic_energy() + engine->potential_energy(), before, 2e-3 * engine->kinetic_energy());
}

TEST_P(DynamicsContract, PlanarJointSlidesAndTurnsUnderWrenches) {
  if (!can().planar) GTEST_SKIP() << "the engine has no planar joints";
  RobotDescription description;
  description.name = "puck";
  description.links = {make_frame("table"), make_link("puck", 2.0, {0, 0, 0}, {0.1, 0.1, 0.02})};
  description.joints = {make_joint("slide", JointType::planar, "table", "puck", {0, 0, 0.5}, {0, 0, 1})};
  const auto engine = make(settings(1e-4), {robot(description)});
  engine->instance(0).apply_wrench(1, {0, 0, 0}, {1.0, -2.0, 30.0}, {5.0, 5.0, 0.04});
  run(*engine, 0.5);
  const std::vector<double> v = copy(engine->instance(0).v());
  EXPECT_NEAR(v[0], 0.25, 1e-3);
  EXPECT_NEAR(v[1], -0.5, 1e-3);
  EXPECT_NEAR(v[2], 1.0, 2e-3);
}

TEST_P(DynamicsContract, WrenchAcceleratesByForceAndTorqueOverInertia) {
  if (!can().floating) GTEST_SKIP() << "the engine has no floating bodies";
  WorldSettings in = settings(1e-4);
  in.gravity.setZero();
  const auto engine = make(in, {object("brick", Box{{0.1, 0.2, 0.4}}, at(0, 0, 1), 1.5)});
  Instance brick = engine->instance(0);
  // A force off the centre: it translates and rotates the body.
  brick.apply_wrench(brick.made_of().base_link(), {0.05, 0, 0}, {0, 0.3, 0}, {0, 0, 0});
  engine->step();
  const double I_zz = 1.5 * (0.01 + 0.04) / 12;
  EXPECT_NEAR(brick.base_velocity().linear_W.y(), 0.3 / 1.5 * 1e-4, 1e-9);
  EXPECT_NEAR(brick.base_velocity().angular_W.z(), 0.05 * 0.3 / I_zz * 1e-4, 1e-8);
  engine->clear_applied();
  const double before = brick.base_velocity().angular_W.z();
  engine->step();
  EXPECT_NEAR(brick.base_velocity().angular_W.z(), before, 1e-12);
}

TEST_P(DynamicsContract, JointEffortAcceleratesByEffortOverInertia) {
  WorldSettings in = settings();
  in.gravity.setZero();
  const auto engine = make(in, {robot(make_pendulum(1.0, 0.5))});
  engine->instance(0).apply_joint_effort(0, 0.5);
  engine->step();
  EXPECT_NEAR(engine->instance(0).v()[0], 0.5 / (0.25 + 1e-6) * 1e-3, 1e-9);
}

TEST_P(DynamicsContract, JointDampingDecaysExponentially) {
  RobotDescription description = make_pendulum(1.0, 0.5);
  description.joints[0].dynamics = JointDynamics{0.5, 0.0, {}};
  WorldSettings in = settings(1e-4);
  in.gravity.setZero();
  const auto engine = make(in, {robot(description)});
  set(engine->instance(0), {0.0}, {2.0});
  run(*engine, 0.5);
  EXPECT_NEAR(engine->instance(0).v()[0], 2.0 * std::exp(-0.5 * 0.5 / 0.250001), 2e-4);
}

TEST_P(DynamicsContract, DivergenceKeepsLastFiniteState) {
  const auto engine = make(settings(), {robot(make_pendulum(1.0, 0.5))});
  set(engine->instance(0), {0.3});
  run(*engine, 0.01);
  const std::vector<double> q = copy(engine->instance(0).q()), v = copy(engine->instance(0).v());
  const Time time = engine->time();
  engine->instance(0).apply_joint_effort(0, 1e200);
  engine->step();
  EXPECT_TRUE(engine->diverged());
  engine->step();
  EXPECT_EQ(copy(engine->instance(0).q()), q);
  EXPECT_EQ(copy(engine->instance(0).v()), v);
  EXPECT_EQ(engine->time(), time);
  engine->reset();
  EXPECT_FALSE(engine->diverged());
}

}  // namespace
}  // namespace doppel::test
