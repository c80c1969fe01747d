// How a step is taken: the order of each scheme, what is implicit, and how effort limits act within it.

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <random>

#include "doppel/physics/contract/step_scheme.h"
#include "doppel/physics/contract/test/allocation_counter.h"
#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/physics/contract/test/reference_motion.h"
#include "doppel/robot/kinematics/test/integrate.h"

namespace doppel {
namespace {

using test::Motion;
using test::ReferenceMotion;
using test::Rig;

constexpr Integrator kAll[] = {Integrator::euler, Integrator::midpoint, Integrator::rk4,
                               Integrator::implicit};

// Amplification of y' = lambda y over one step, z = h lambda, with J exact.
std::complex<double> amplification(const StepScheme& s, std::complex<double> z) {
  std::array<std::complex<double>, kMaxStages> k{};
  std::complex<double> out = 1.0;
  for (int i = 0; i < s.stages; ++i) {
    std::complex<double> right = 1.0;
    for (int j = 0; j < i; ++j) right += z * (s.alpha[i][j] + s.gamma[i][j]) * k[j];
    k[i] = right / (1.0 - z * s.gamma[i][i]);
    out += z * s.b[i] * k[i];
  }
  return out;
}

TEST(StepScheme, TablesFulfilOrderConditions) {
  for (const Integrator integrator : {Integrator::midpoint, Integrator::rk4}) {
    SCOPED_TRACE(name_of(integrator));
    const StepScheme& s = step_scheme(integrator);
    double b = 0, bc = 0, bg = 0, bag = 0, bgc = 0, bgg = 0;
    for (int i = 0; i < s.stages; ++i) {
      EXPECT_EQ(s.gamma[i][i], s.diagonal);
      b += s.b[i];
      bc += s.b[i] * s.time(i);
      bg += s.b[i] * s.gamma_sum(i);
      for (int j = 0; j <= i; ++j) {
        bag += s.b[i] * s.alpha[i][j] * s.gamma_sum(j);
        bgc += s.b[i] * s.gamma[i][j] * s.time(j);
        bgg += s.b[i] * s.gamma[i][j] * s.gamma_sum(j);
      }
    }
    EXPECT_NEAR(b, 1, 1e-15);
    EXPECT_NEAR(bc, 0.5, 1e-15);
    EXPECT_NEAR(bg, 0, 1e-15) << "expected order 2 for any J";
    if (s.order == 4) {
      EXPECT_NEAR(bag, 0, 1e-15) << "expected order 3 for any J";
      EXPECT_NEAR(bgc, 0, 1e-15);
      EXPECT_NEAR(bgg, 0, 1e-15);
    }
    for (double w = 1e-3; w < 1e6; w *= 1.5) {
      EXPECT_LE(std::abs(amplification(s, {0, w})), 1 + 1e-12) << "expected A-stability at i " << w;
      EXPECT_LE(std::abs(amplification(s, {-w, w})), 1 + 1e-12);
    }
    EXPECT_LT(std::abs(amplification(s, -1e9)), 1e-6) << "expected L-stability";
  }
}

// Largest distance of a passive fall from the reference after 0.2 s.
double error_of_fall(const RobotDescription& robot, Integrator integrator, double step,
                     const Eigen::VectorXd& start, const Motion& reference) {
  Rig rig(robot, test::empty_space(step, integrator));
  rig.set_state({start.data(), start.data() + start.size()});
  rig.run(0.2);
  return (Eigen::Map<const Eigen::VectorXd>(rig.robot.q().data(), rig.model.nq) - reference.q)
      .cwiseAbs()
      .maxCoeff();
}

TEST(IntegrationStep, PassiveFallConvergesWithSchemeOrder) {
  const unsigned seed = 5;
  std::mt19937 random(seed);
  for (int round = 0; round < 4; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + " round " + std::to_string(round));
    const RobotDescription robot = test::make_random_chain(test::six_hinges(), random);
    Rig rig(robot);
    const Eigen::VectorXd start = test::random_configuration(rig.model, random);
    ReferenceMotion reference(rig.model, rig.world.gravity);
    Motion exact{start, Eigen::VectorXd::Zero(rig.model.nv)};
    const auto free = [&](const Motion&) { return Eigen::VectorXd::Zero(rig.model.nv).eval(); };
    for (int i = 0; i < 4000; ++i) reference.step(exact, 5e-5, free);
    for (const Integrator integrator : kAll) {
      SCOPED_TRACE(name_of(integrator));
      const double coarse = error_of_fall(robot, integrator, 1e-3, start, exact);
      const double fine = error_of_fall(robot, integrator, 5e-4, start, exact);
      const int order = step_scheme(integrator).order;
      RecordProperty(std::string(name_of(integrator)) + std::to_string(round), std::to_string(coarse));
      EXPECT_NEAR(std::log2(coarse / fine), order, 0.35) << coarse << " " << fine;
    }
  }
}

// Springs and dampers of every magnitude, on a chain that swings under gravity: the schemes keep their order.
TEST(IntegrationStep, DrivenMotionConvergesWithSecondOrder) {
  std::mt19937 random(6);
  const RobotDescription robot = test::make_random_chain(test::six_hinges(), random);
  InstanceOptions options;
  Rig model(robot);
  for (int i = 0; i < static_cast<int>(model.model.joints.size()); ++i) {
    ServoParameters servo{5.0, 0.3, kInfinity, kInfinity};  // soft: the error is that of the step
    options.servos.push_back(servo);
  }
  const Eigen::VectorXd start = test::random_configuration(model.model, random);
  const auto end_of = [&](Integrator integrator, double step) {
    Rig rig(robot, test::empty_space(step, integrator), options);
    rig.set_state({start.data(), start.data() + start.size()});
    rig.hold_all();
    rig.run(0.5);
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(rig.robot.q().data(), rig.model.nq));
  };
  ReferenceMotion reference(model.model, model.world.gravity);
  Motion exact{start, Eigen::VectorXd::Zero(model.model.nv)};
  for (int i = 0; i < 10000; ++i) {
    reference.step(exact, 5e-5, [&](const Motion& at) { return (5.0 * (start - at.q) - 0.3 * at.v).eval(); });
  }
  for (const Integrator integrator : kAll) {
    SCOPED_TRACE(name_of(integrator));
    const double coarse = (end_of(integrator, 1e-3) - exact.q).cwiseAbs().maxCoeff();
    const double fine = (end_of(integrator, 5e-4) - exact.q).cwiseAbs().maxCoeff();
    const double order = std::min(step_scheme(integrator).order, 3);  // of a W-method with this J
    EXPECT_GT(std::log2(coarse / fine), order - 0.35) << coarse << " " << fine;
  }
}

// Without constraints a step of euler is (M + h D) dv = h (tau - bias - D v), q += h v.
TEST(IntegrationStep, EulerMatchesFormulaWithoutConstraints) {
  std::mt19937 random(7);
  RobotDescription robot = test::make_random_chain(test::six_hinges(), random);
  for (Joint& joint : robot.joints) joint.dynamics = JointDynamics{0.2, 0.0, {}};
  Rig rig(robot);
  const Eigen::VectorXd start = test::random_configuration(rig.model, random);
  rig.set_state({start.data(), start.data() + start.size()});
  rig.hold_all();
  ReferenceMotion reference(rig.model, rig.world.gravity);
  Eigen::VectorXd K(rig.model.nv), D(rig.model.nv);
  for (int i = 0; i < rig.model.nv; ++i) {
    const ServoParameters& servo = rig.servos()[static_cast<std::size_t>(i)];
    K[i] = servo.stiffness;
    D[i] = std::max(servo.damping, servo.stiffness * 1e-3);
  }
  Motion at{start, Eigen::VectorXd::Zero(rig.model.nv)};
  for (int i = 0; i < 500; ++i) {
    Eigen::MatrixXd M;
    Eigen::VectorXd bias;
    reference.evaluate(at, M, bias);
    const Eigen::VectorXd all = D.array() + 0.2;
    M.diagonal() += 1e-3 * all;
    at.v += 1e-3 * M.ldlt().solve(K.cwiseProduct(start - at.q) - all.cwiseProduct(at.v) - bias);
    at.q += 1e-3 * at.v;
    rig.engine->step();
  }
  EXPECT_NEAR((Eigen::Map<const Eigen::VectorXd>(rig.robot.q().data(), rig.model.nq) - at.q).norm(), 0,
              1e-12);
}

TEST(IntegrationStep, RestIsHeldUnderEveryIntegrator) {
  std::mt19937 random(8);
  RobotDescription robot = test::make_random_chain(test::six_hinges(), random);
  for (Joint& joint : robot.joints) joint.dynamics = JointDynamics{0.1, 0.3, {}};  // with Coulomb friction
  for (const Integrator integrator : kAll) {
    for (const double step : {0.001, 0.002, 0.005, 0.01, 0.02}) {
      SCOPED_TRACE(std::string(name_of(integrator)) + " " + std::to_string(step));
      Rig rig(robot, test::empty_space(step, integrator));
      const Eigen::VectorXd start = test::random_configuration(rig.model, random);
      rig.set_state({start.data(), start.data() + start.size()});
      rig.hold_all();
      rig.run(1.0);
      for (const double v : rig.robot.v()) EXPECT_LT(std::abs(v), 1e-3);
      for (int i = 0; i < rig.model.nq; ++i) EXPECT_NEAR(rig.robot.q()[i], start[i], 0.02);
    }
  }
}

// A joint of 1 kg m^2 whose servo needs more than its 2 N m accelerates with 2 rad/s^2, not less.
TEST(IntegrationStep, ClippedDriveHasNoImplicitDamping) {
  RobotDescription robot = test::make_pendulum(1.0, 1.0);
  robot.joints[0].axis = {0, 0, 1};  // about the vertical: no gravity
  robot.links[1] = test::make_link("bob", 1.0, {1, 0, 0}, {1e-9, 1e-9, 1e-9});
  for (const Integrator integrator : kAll) {
    SCOPED_TRACE(name_of(integrator));
    InstanceOptions options;
    options.servos = {{1000.0, 500.0, 2.0, 1e6}};
    Rig rig(robot, test::empty_space(1e-3, integrator), options);
    rig.hold_all();
    rig.robot.set_target(0, 10.0);
    rig.run(0.1);
    EXPECT_NEAR(rig.v("swing"), 0.2, 1e-6);
    EXPECT_EQ(rig.effort("swing"), 2.0);
  }
}

// Whatever load acts on it, a drive never exceeds its limit: the effort that acted, computed from the motion
// by Newton-Euler, equals the reported one. `implicit` clips with euler's acceleration and is left out.
TEST(IntegrationStep, ReportedEffortIsAppliedAndLimited) {
  std::mt19937 random(9);
  const RobotDescription robot = test::make_random_chain(test::six_hinges(), random);
  Rig sized(robot);
  InstanceOptions options;
  options.servos.assign(sized.servos().begin(), sized.servos().end());
  for (ServoParameters& servo : options.servos) {
    servo.effort = 0.3;
    servo.velocity = 3.0;
  }
  Rig rig(robot, test::empty_space(1e-3, Integrator::euler), options);
  rig.hold_all();
  ReferenceMotion reference(rig.model, rig.world.gravity);
  std::uniform_real_distribution<double> unit(-2, 2);
  const auto state = [&rig] {
    return Motion{Eigen::Map<const Eigen::VectorXd>(rig.robot.q().data(), 6),
                  Eigen::Map<const Eigen::VectorXd>(rig.robot.v().data(), 6)};
  };
  int clipped = 0;
  for (int i = 0; i < 2000; ++i) {
    if (i % 100 == 0) {
      for (int j = 0; j < 6; ++j) rig.robot.set_target(j, unit(random));
    }
    const Motion before = state();
    rig.engine->step();
    Eigen::MatrixXd M;
    Eigen::VectorXd bias;
    reference.evaluate(before, M, bias);
    const Eigen::VectorXd acted = M * (state().v - before.v) / 1e-3 + bias;
    for (int j = 0; j < 6; ++j) {
      ASSERT_LE(std::abs(acted[j]), 0.3 + 1e-7) << "step " << i;
      ASSERT_NEAR(acted[j], rig.robot.drive_effort()[static_cast<std::size_t>(j)], 1e-7) << "step " << i;
      clipped += std::abs(acted[j]) > 0.3 - 1e-7 ? 1 : 0;
    }
  }
  EXPECT_GT(clipped, 1000);
}

TEST(IntegrationStep, ClippedDrivesStayStableUnderEveryIntegrator) {
  std::mt19937 random(10);
  for (const Integrator integrator : kAll) {
    SCOPED_TRACE(name_of(integrator));
    RobotDescription robot = test::make_random_chain(test::six_hinges(), random);
    for (Joint& joint : robot.joints) {
      joint.type = JointType::revolute;
      test::limit(joint, -3, 3, 0.3, 3);
    }
    Rig rig(robot, test::empty_space(1e-3, integrator));
    rig.hold_all();
    std::uniform_real_distribution<double> unit(-2, 2);
    for (int i = 0; i < 2000; ++i) {
      if (i % 100 == 0) {
        for (int j = 0; j < 6; ++j) rig.robot.set_target(j, unit(random));
      }
      rig.engine->step();
    }
    EXPECT_FALSE(rig.engine->diverged());
    for (const double v : rig.robot.v()) EXPECT_LT(std::abs(v), 100);
  }
}

// What springs and dampers add to the matrix of the step is not an inertia: the energy is that of the masses.
TEST(IntegrationStep, EnergyOfDrivenMotionExcludesArmature) {
  std::mt19937 random(11);
  RobotDescription robot = test::make_random_chain(test::six_hinges(), random);
  for (Joint& joint : robot.joints) joint.dynamics = JointDynamics{0.5, 0.0, {}};
  for (const Integrator integrator : kAll) {
    Rig rig(robot, test::empty_space(1e-3, integrator));
    rig.hold_all();
    for (int j = 0; j < 6; ++j) rig.robot.set_target(j, 1.0);
    rig.run(0.05);
    ReferenceMotion reference(rig.model, rig.world.gravity);
    const Motion at{Eigen::Map<const Eigen::VectorXd>(rig.robot.q().data(), 6),
                    Eigen::Map<const Eigen::VectorXd>(rig.robot.v().data(), 6)};
    Eigen::MatrixXd M;
    Eigen::VectorXd bias;
    reference.evaluate(at, M, bias);
    const double kinetic = 0.5 * at.v.dot(M * at.v);
    ASSERT_GT(kinetic, 1e-6);
    EXPECT_NEAR(rig.engine->kinetic_energy(), kinetic, 1e-9 * kinetic) << name_of(integrator);
  }
}

// A freely tumbling body conserves its energy and angular momentum; the error of the step shrinks with the
// order.
TEST(IntegrationStep, TumblingBodyConvergesWithSchemeOrder) {
  RobotDescription robot;
  robot.name = "tumbler";
  robot.links = {test::make_link("body", 1.0, {0, 0, 0}, {0.02, 0.05, 0.06})};
  const auto end_of = [&](Integrator integrator, double step) {
    World space = test::empty_space(step, integrator);
    space.gravity.setZero();
    Rig rig(robot, space, {}, BaseKind::floating);
    rig.set_state({0, 0, 0, 0, 0, 0, 1}, {0.1, 0.2, 0.3, 2.0, 7.0, 1.0});
    rig.run(0.5);
    return Eigen::Quaterniond(rig.robot.link_pose(rig.model.find_link("body")).linear());
  };
  const Eigen::Quaterniond exact = end_of(Integrator::rk4, 1e-4);
  for (const Integrator integrator : {Integrator::euler, Integrator::midpoint, Integrator::rk4}) {
    const double coarse = end_of(integrator, 4e-3).angularDistance(exact);
    const double fine = end_of(integrator, 2e-3).angularDistance(exact);
    EXPECT_NEAR(std::log2(coarse / fine), step_scheme(integrator).order, 0.35)
        << name_of(integrator) << " " << coarse << " " << fine;
  }
}

// A free object elsewhere does not change the order of the robot's motion.
TEST(IntegrationStep, MidpointKeepsOrderDuringContact) {
  std::mt19937 random(12);
  RobotDescription robot = test::make_random_chain(test::six_hinges(), random);
  const auto end_of = [&](Integrator integrator, double step, bool with_puck) {
    World world = test::empty_space(step, integrator);
    if (with_puck) {
      world.ground = true;
      world.objects.push_back(test::make_object("puck", Box{{0.1, 0.1, 0.02}}, {30, 0, 0.01}, 0.2));
    }
    Rig rig(robot, world);
    rig.set_state({0.5, -0.4, 0.3, 0.2, 0.1, 0.6});
    rig.run(0.2);
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(rig.robot.q().data(), 6));
  };
  const Eigen::VectorXd exact = end_of(Integrator::rk4, 2.5e-4, false);
  const double alone = (end_of(Integrator::midpoint, 1e-3, false) - exact).norm();
  const double beside = (end_of(Integrator::midpoint, 1e-3, true) - exact).norm();
  EXPECT_NEAR(beside, alone, 0.01 * alone);
}

// With drives that reach and leave their limits, stops that are hit, a follower, and an object on the ground.
TEST(IntegrationStep, StepDoesNotAllocateUnderAnyIntegrator) {
  std::mt19937 random(13);
  RobotDescription robot = test::make_random_chain(test::six_hinges(), random);
  for (Joint& joint : robot.joints) {
    joint.type = JointType::revolute;
    test::limit(joint, -0.4, 0.4, 0.5, 3);
    GazeboExtension stop;
    stop.reference = joint.name;
    stop.stop_stiffness = 50.0;
    robot.gazebo.push_back(stop);
  }
  robot.joints[5].mimic = Mimic{robot.joints[4].name, 1, 0, {}};
  for (const Integrator integrator : kAll) {
    World world = test::empty_space(1e-3, integrator);
    world.ground = true;
    world.objects.push_back(test::make_object("ball", Sphere{0.05}, {20, 0, 0.1}, 0.2));
    Rig rig(robot, world);
    rig.hold_all();
    for (int i = 0; i < 10; ++i) rig.engine->step();
    const std::uint64_t before = test::heap_allocations();
    for (int i = 0; i < 1000; ++i) {
      for (int j = 0; j < 5; ++j) rig.robot.set_target(j, i % 200 < 100 ? 1.0 : -1.0);
      rig.engine->step();
    }
    EXPECT_EQ(test::heap_allocations() - before, 0U) << name_of(integrator);
    EXPECT_FALSE(rig.engine->diverged());
  }
}

}  // namespace
}  // namespace doppel
