// The engine against closed forms and against dynamics that share no code with it.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/physics/contract/test/mujoco_extras.h"
#include "doppel/robot/kinematics/test/integrate.h"

namespace doppel {
namespace {

using test::empty_space;
using test::Rig;

// Period of a pendulum released at rest at `amplitude`: 2 pi sqrt(l / g) / agm(1, cos(amplitude / 2)), which
// is the complete elliptic integral by Gauss's arithmetic-geometric mean.
double closed_form_period(double amplitude, double inertia, double mass, double length) {
  double a = 1.0, b = std::cos(amplitude / 2);
  for (int i = 0; i < 30; ++i) {
    const double mean = 0.5 * (a + b);
    b = std::sqrt(a * b);
    a = mean;
  }
  return 2 * std::numbers::pi * std::sqrt(inertia / (mass * 9.81 * length)) / a;
}

// Time between the first and the third passage through zero, interpolated within the step.
double measured_period(Rig& rig) {
  std::vector<double> crossings;
  double before = rig.q("swing");
  while (crossings.size() < 3) {
    const double t = to_seconds(rig.engine->time());
    rig.engine->step();
    const double now = rig.q("swing");
    if ((before > 0) != (now > 0))
      crossings.push_back(t + to_seconds(rig.world.step) * before / (before - now));
    before = now;
    if (t > 60) break;
  }
  return crossings.size() < 3 ? 0.0 : crossings[2] - crossings[0];
}

TEST(PhysicsReference, PendulumHasClosedFormPeriod) {
  const double mass = 0.7, length = 0.6, inertia = mass * length * length + 1e-6;
  for (const double amplitude : {0.1, 0.5, 1.0, 1.5, 2.0, 2.5}) {
    SCOPED_TRACE("amplitude " + std::to_string(amplitude));
    Rig rig(test::make_pendulum(mass, length));
    rig.set_state({amplitude});
    const double expected = closed_form_period(amplitude, inertia, mass, length);
    EXPECT_NEAR(measured_period(rig), expected, 1e-4 * expected)
        << "expected the exact period with implicit steps of 1 ms";
    World fine = empty_space();
    fine.integrator = Integrator::rk4;
    Rig exact(test::make_pendulum(mass, length), fine);
    exact.set_state({amplitude});
    EXPECT_NEAR(measured_period(exact), expected, 2e-6 * expected)
        << "expected the exact period with rk4 steps of 1 ms";
  }
}

// Total energy over `seconds`, as the largest deviation from the start relative to the energy that moves
// (from the lowest pose). Semi-implicit integration moves q with the new v, so the v that belongs to an
// instant's q is the mean of the steps around it: potential energy is evaluated at q_n and kinetic energy as
// the mean of those at v_n and v_n+1. rk4 has both at one instant and needs no correction.
double energy_departure(Rig& rig, double seconds, double lowest, bool staggered) {
  double start = 0, worst = 0, previous_potential = rig.engine->potential_energy();
  double previous_kinetic = rig.engine->kinetic_energy();
  const auto steps = from_seconds(seconds) / rig.world.step;
  for (std::int64_t i = 0; i < steps; ++i) {
    rig.engine->step();
    const double kinetic = rig.engine->kinetic_energy(), potential = rig.engine->potential_energy();
    const double total =
        staggered ? previous_potential + 0.5 * (previous_kinetic + kinetic) : potential + kinetic;
    if (i == 0) {
      start = total;
      EXPECT_GT(start - lowest, 1) << "expected a start above the lowest pose";
    }
    worst = std::max(worst, std::abs(total - start) / (start - lowest));
    previous_potential = potential;
    previous_kinetic = kinetic;
  }
  return worst;
}

TEST(PhysicsReference, EnergyIsConservedWithoutFriction) {
  const double one = 0.7 * 9.81 * (2 - 0.6);
  const double two = 1.0 * 9.81 * (2 - 0.4) + 0.5 * 9.81 * (2 - 0.7);
  for (const Integrator integrator : {Integrator::euler, Integrator::rk4}) {
    const bool staggered = integrator == Integrator::euler;
    // Energy that bodies exchange by turning each other is integrated to first order in the step by the
    // implicit scheme, to fourth order by rk4.
    World coarse = empty_space(1e-3), fine = empty_space(staggered ? 2.5e-5 : 1e-3);
    coarse.integrator = fine.integrator = integrator;
    Rig single(test::make_pendulum(0.7, 0.6), coarse);
    single.set_state({2.0});
    EXPECT_NEAR(single.engine->potential_energy(), 0.7 * 9.81 * (2 - 0.6 * std::cos(2.0)), 1e-9);
    EXPECT_LT(energy_departure(single, 10, one, staggered), staggered ? 1e-5 : 1e-9);
    Rig twin(test::make_double_pendulum(1.0, 0.4, 0.5, 0.3), fine);
    twin.set_state({1.5, 1.0});
    EXPECT_LT(energy_departure(twin, 10, two, staggered), staggered ? 1e-3 : 1e-6);
  }
}

TEST(PhysicsReference, InverseDynamicsAgreeWithNewtonEuler) {
  const unsigned seed = 21;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-2, 2);
  for (int round = 0; round < 20; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + " round " + std::to_string(round));
    std::vector<JointType> types = test::six_hinges();
    types[2] = JointType::prismatic;
    types[4] = JointType::planar;
    types[1] = JointType::fixed;
    if (round % 2 == 1) types[0] = JointType::floating;
    Rig rig(test::make_random_chain(types, random));
    const Eigen::VectorXd q = test::random_configuration(rig.model, random);
    const Eigen::VectorXd v = Eigen::VectorXd::NullaryExpr(rig.model.nv, [&] { return unit(random); });
    const Eigen::VectorXd a = Eigen::VectorXd::NullaryExpr(rig.model.nv, [&] { return unit(random); });
    rig.set_state({q.data(), q.data() + q.size()}, {v.data(), v.data() + v.size()});
    Data data(rig.model);
    inverse_dynamics(rig.model, data, q, v, a, rig.world.gravity);
    Eigen::VectorXd tau(rig.model.nv);
    mujoco_inverse_dynamics(*rig.engine, {a.data(), static_cast<std::size_t>(a.size())},
                            {tau.data(), static_cast<std::size_t>(tau.size())});
    EXPECT_NEAR((data.tau - tau).norm(), 0, 1e-6 * (1 + tau.norm())) << data.tau.transpose() << "\n"
                                                                     << tau.transpose();
    forward_kinematics(rig.model, data, q);
    const int last = static_cast<int>(rig.model.links.size()) - 1;
    EXPECT_NEAR((rig.robot.link_pose(last).matrix() - data.X_WL[last].matrix()).norm(), 0, 1e-12);
  }
}

TEST(PhysicsReference, HoldingTorqueIsGravityTorque) {
  const unsigned seed = 22;
  std::mt19937 random(seed);
  for (int round = 0; round < 12; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + " round " + std::to_string(round));
    World space = empty_space();
    space.X_WR = make_pose({0.1, 0.2, 0.3},
                           {0.4, -0.7, 1.1});  // a tilted base: gravity must be expressed in its frame
    Rig rig(test::make_random_chain(test::six_hinges(), random), space);
    const Eigen::VectorXd q = test::random_configuration(rig.model, random);
    rig.set_state({q.data(), q.data() + q.size()});
    rig.hold_all();
    rig.run(3.0);
    Data data(rig.model);
    const Eigen::VectorXd held = Eigen::Map<const Eigen::VectorXd>(rig.robot.q().data(), rig.model.nq);
    gravity_torques(rig.model, data, held, space.X_WR.linear().transpose() * space.gravity);
    for (std::size_t i = 0; i < rig.model.joints.size(); ++i) {
      EXPECT_NEAR(rig.robot.drive_effort()[i], data.tau[rig.model.joints[i].v], 1e-5);
      // and the sag is that torque divided by the stiffness
      const double sag = q[rig.model.joints[i].q] - held[rig.model.joints[i].q];
      const double expected = data.tau[rig.model.joints[i].v] / rig.servos()[i].stiffness;
      EXPECT_NEAR(sag, expected, 0.01 * std::abs(expected) + 1e-9);
    }
  }
}

TEST(PhysicsReference, FreeFallIsHalfGTSquared) {
  World world = empty_space();
  world.objects.push_back(test::make_object("ball", Sphere{0.05}, {0, 0, 10}, 0.3));
  Rig rig(test::make_post(), world);
  const int steps = 1000;
  for (int i = 0; i < steps; ++i) rig.engine->step();
  Pose X;
  X = rig.pose("ball");
  EXPECT_NEAR(10 - X.translation().z(), 0.5 * 9.81, 0.5 * 9.81 * 1.01e-3)
      << "expected a semi-implicit error of one step, 0.1 %";
  EXPECT_NEAR(10 - X.translation().z(), 0.5 * 9.81 * 1e-6 * steps * (steps + 1), 1e-9)
      << "expected exactly the sum of the semi-implicit scheme";
}

TEST(PhysicsReference, CoulombFrictionHoldsJointUntilLimit) {
  RobotDescription robot = test::make_pendulum(1.0, 0.1);  // 0.981 N m when horizontal
  robot.joints[0].dynamics = JointDynamics{0.0, 1.05, {}};
  Rig holds(robot);
  holds.set_state({std::numbers::pi / 2});
  holds.run(10.0);
  EXPECT_NEAR(holds.q("swing"), std::numbers::pi / 2, 1e-3);
  robot.joints[0].dynamics->friction = 0.9;
  Rig slips(robot);
  slips.set_state({std::numbers::pi / 2});
  slips.run(10.0);
  // It stops on its way where gravity has become smaller than the friction.
  EXPECT_LT(std::abs(std::sin(slips.q("swing"))) * 0.981, 0.9);
  EXPECT_NEAR(slips.v("swing"), 0, 1e-4);
}

// Friction is solved as a stiff damper: what it holds creeps at 1e-4 of the step times the acceleration that
// it cancels.
TEST(PhysicsReference, CoulombFrictionCreepMatchesFormula) {
  RobotDescription robot = test::make_pendulum(1.0, 0.1);
  robot.joints[0].dynamics = JointDynamics{0.0, 1.05, {}};
  for (const double step : {5e-4, 1e-3, 2e-3}) {
    Rig rig(robot, empty_space(step));
    rig.set_state({std::numbers::pi / 2});
    rig.run(0.5);
    const double taken = 1.0 * 9.81 * 0.1 / (1.0 * 0.1 * 0.1 + 1e-6);  // rad/s^2
    EXPECT_NEAR(rig.v("swing"), -1e-4 * step * taken, 0.02e-4 * step * taken);
  }
}

// A slope of angle t holds a box below atan(mu) and lets it slide above, then with g (sin t - mu cos t).
TEST(PhysicsReference, BoxSticksOnSlopeBelowFrictionAngle) {
  const double mu = 0.5;
  for (const double angle : {0.95 * std::atan(mu), 1.05 * std::atan(mu)}) {
    World world = empty_space();
    WorldObject slope = test::make_object("slope", Box{{4, 4, 0.2}}, {0, 0, 0}, 0);
    slope.X_WO = make_pose({0, 0, 0}, {0, angle, 0});
    WorldObject box = test::make_object("box", Box{{0.1, 0.1, 0.04}}, {0, 0, 0}, 0.5);
    box.X_WO = slope.X_WO * make_pose({-1, 0, 0.12}, {0, 0, 0});
    slope.friction = box.friction = mu;
    world.objects = {slope, box};
    Rig rig(test::make_post(), world);
    rig.run(0.5);
    Pose before, after;
    before = rig.pose("box");
    rig.run(1.0);
    after = rig.pose("box");
    const double way =
        (slope.X_WO.inverse() * after).translation().x() - (slope.X_WO.inverse() * before).translation().x();
    if (angle < std::atan(mu)) {
      EXPECT_LT(std::abs(way), 1e-4);
    } else {
      const double a = 9.81 * (std::sin(angle) - mu * std::cos(angle));
      EXPECT_NEAR(way, 0.5 * a * (1.5 * 1.5 - 0.5 * 0.5), 0.1 * a);
    }
  }
}

}  // namespace
}  // namespace doppel
