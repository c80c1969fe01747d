#include "doppel/physics/contract/detail/limit_stop.h"

#include <gtest/gtest.h>

#include <cmath>

#include "doppel/physics/contract/test/engine_fixture.h"

namespace doppel {
namespace {

using test::Rig;

// A slide of 2 kg along x between -0.1 and 0.1 m.
RobotDescription make_slide(double stiffness, double restitution) {
  RobotDescription robot = test::make_pendulum(2.0, 0.0);
  robot.joints[0].type = JointType::prismatic;
  robot.joints[0].axis = {1, 0, 0};
  test::limit(robot.joints[0], -0.1, 0.1, 100, 10);
  GazeboExtension stop;
  stop.reference = "swing";
  if (stiffness > 0) stop.stop_stiffness = stiffness;
  stop.stop_restitution = restitution;
  robot.gazebo.push_back(stop);
  return robot;
}

TEST(LimitStop, DampingRatioAndRestitutionAreInverse) {
  for (const double e : {0.03, 0.1, kCriticalRestitution, 0.3, 0.5, 0.9, 0.99})
    EXPECT_NEAR(restitution_of(damping_ratio_of(e)), e, 1e-9);
  EXPECT_EQ(damping_ratio_of(1.0), 0.0);
  EXPECT_NEAR(restitution_of(1.0 - 1e-7), restitution_of(1.0), 1e-6);
  EXPECT_NEAR(restitution_of(1.0 + 1e-7), restitution_of(1.0), 1e-6);
}

// An impact integrated in steps of 1e-5 of its period agrees with the closed form.
TEST(LimitStop, RestitutionMatchesIntegratedImpact) {
  for (const double z : {0.05, 0.3, 0.6, 0.8, 1.5}) {
    double x = 0, v = 1, force = 0;
    do {
      v += 1e-5 * force;
      x += 1e-5 * v;
      force = -x - 2 * z * v;
    } while (force < 0);
    EXPECT_NEAR(-v, restitution_of(z), 1e-4) << z;
  }
}

TEST(LimitStop, ReboundSpeedIsRestitutionTimesSpeed) {
  for (const Integrator integrator : {Integrator::euler, Integrator::midpoint, Integrator::rk4}) {
    for (const double e : {0.2, 0.5, 0.9}) {
      for (const double side : {-1.0, 1.0}) {
        SCOPED_TRACE(std::string(name_of(integrator)) + " " + std::to_string(e));
        Rig rig(make_slide(2e4, e),
                test::empty_space(1e-3, integrator));  // w0 = 100 rad/s: the step is a tenth of 1 / w0
        rig.set_state({0.0}, {side * 1.0});
        rig.run(0.3);
        EXPECT_NEAR(rig.v("swing"), -side * e, 0.03);
      }
    }
  }
}

TEST(LimitStop, YieldIsLoadOverStiffness) {
  for (const Integrator integrator : {Integrator::euler, Integrator::midpoint, Integrator::rk4}) {
    Rig rig(make_slide(5e3, kCriticalRestitution), test::empty_space(1e-3, integrator));
    rig.set_state({0.09});
    rig.robot.apply_joint_effort(0, 25.0);
    rig.run(2.0);
    EXPECT_NEAR(rig.q("swing") - 0.1, 25.0 / 5e3, 1e-9);
    EXPECT_NEAR(rig.v("swing"), 0.0, 1e-9);
  }
}

TEST(LimitStop, StiffnessBeyondStepIsStable) {
  for (const Integrator integrator : {Integrator::euler, Integrator::midpoint, Integrator::rk4}) {
    Rig rig(make_slide(1e10, 0.9), test::empty_space(0.01, integrator));
    rig.set_state({0.0}, {3.0});
    rig.run(1.0);
    EXPECT_LE(std::abs(rig.v("swing")), 3.0 * 1.01);
    EXPECT_LE(std::abs(rig.q("swing")), 0.1 + 3.0 * 0.0101);
  }
}

// Without a stiffness it is MuJoCo's: a critically damped spring with a time constant of five steps. The
// penetration is 1.2 steps of the impact speed, and almost nothing bounces back.
TEST(LimitStop, DefaultStopDoesNotBounce) {
  for (const double step : {1e-3, 2e-3}) {
    Rig rig(make_slide(0, kCriticalRestitution), test::empty_space(step));
    rig.set_state({0.0}, {1.0});
    double deepest = 0, fastest_back = 0;
    for (int i = 0; i < 400; ++i) {
      rig.engine->step();
      deepest = std::max(deepest, rig.q("swing") - 0.1);
      fastest_back = std::min(fastest_back, rig.v("swing"));
    }
    EXPECT_NEAR(deepest, 1.2 * step, 0.1 * step);
    EXPECT_GT(fastest_back, -0.15);
  }
}

TEST(LimitStop, ImpossibleStopIsReportedAndIgnored) {
  const auto warnings_of = [](const RobotDescription& robot, Model& model) {
    Diagnostics diagnostics;
    model = compile_model(robot, BaseKind::fixed, diagnostics);
    int count = 0;
    for (const Diagnostic& diagnostic : diagnostics.all())
      count += diagnostic.rule == "model.limit_stop" ? 1 : 0;
    return count;
  };
  Model model;
  EXPECT_EQ(warnings_of(make_slide(0, 0.5), model), 1)
      << "expected a warning: a restitution without a stiffness";
  EXPECT_EQ(model.joints[0].stop_restitution, kCriticalRestitution);
  EXPECT_EQ(warnings_of(make_slide(100, 1.5), model), 1);
  EXPECT_EQ(model.joints[0].stop_restitution, kCriticalRestitution);
  RobotDescription robot = make_slide(100, 0.5);
  for (const double stiffness : {-3.0, 0.0, 1e300}) {
    robot.gazebo[0].stop_stiffness = stiffness;
    EXPECT_EQ(warnings_of(robot, model), 1) << stiffness;
    EXPECT_EQ(model.joints[0].stop_stiffness, 0.0);
  }
  robot = make_slide(100, 0.5);
  robot.joints[0].type = JointType::continuous;
  EXPECT_EQ(warnings_of(robot, model), 1) << "expected a warning: the joint has no limits to stop at";
}

TEST(LimitStop, BlocksOfOneJointAreMerged) {
  RobotDescription robot = make_slide(100, 0.5);
  robot.gazebo.push_back(robot.gazebo[0]);
  robot.gazebo[0].stop_restitution.reset();
  robot.gazebo[1].stop_stiffness.reset();
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  EXPECT_TRUE(diagnostics.all().empty());
  EXPECT_EQ(model.joints[0].stop_stiffness, 100);
  EXPECT_EQ(model.joints[0].stop_restitution, 0.5);
}

// Whatever its stiffness, no impact creates energy.
TEST(LimitStop, ReboundNeverExceedsImpactSpeed) {
  for (double stiffness = 1e2; stiffness < 1e9; stiffness *= 1.7) {
    for (const double start : {0.0, 0.0003, 0.0007}) {
      Rig rig(make_slide(stiffness, 1.0));
      rig.set_state({start}, {1.0});
      rig.run(0.3);
      EXPECT_LT(std::abs(rig.v("swing")), 1.01) << stiffness;
    }
  }
}

}  // namespace
}  // namespace doppel
