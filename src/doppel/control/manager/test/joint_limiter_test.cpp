#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/test/manager_rig.h"

namespace doppel {
namespace {

using Names = std::vector<std::string>;

// Writes the test's value unchanged.
class Writer : public Controller {
 public:
  Writer(const double& value, std::string interface) : value_(value), interface_(std::move(interface)) {}
  void on_init(ControllerContext&) override {}
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override {
    return {InterfaceConfiguration::Kind::individual, {interface_}};
  }
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override { return {}; }
  void update(Time, Duration) override { command_handles[0].set(value_); }

 private:
  const double& value_;
  std::string interface_;
};

struct LimitRig : ManagerRig {
  LimitRig(FakeJoint joint, const std::string& interface, const std::string& more = "", double start = 0)
      : ManagerRig("controller_manager: {ros__parameters: {w: {type: test/Writer}}}\n" + more, {joint},
                   hardware_with(interface)),
        full_name(joint.name + "/" + interface) {
    registry.add("test/Writer", [this] { return std::make_unique<Writer>(value, full_name); });
    hardware->set_position(joint.name, start);
    manager->start(Names{"w"});
  }
  static FakeHardwareOptions hardware_with(const std::string& interface) {
    FakeHardwareOptions options;
    options.joints = {"j 1"};
    options.commands = {interface};
    return options;
  }
  double applied() const { return hardware->last_command(full_name); }
  double value = kNaN;
  std::string full_name;
};

TEST(JointLimiter, PositionOutsideIsClampedAndReportedOnce) {
  LimitRig rig({.name = "j 1", .lower = -1, .upper = 2}, "position");
  rig.value = 2.5;
  rig.run(40);
  EXPECT_EQ(rig.applied(), 2.0);
  rig.value = 2.75;
  rig.run(200);
  EXPECT_EQ(rig.count(Severity::warning,
                      "j 1: command 2.5 rad is outside the limits -1 to 2 rad; clamped to the limit"),
            1u)
      << rig.said();
  EXPECT_EQ(rig.lines.size(), 1u) << rig.said();
  rig.value = 0;
  rig.run(150);  // more than a second inside: the episode is over
  rig.value = -7;
  rig.run(50);
  EXPECT_EQ(rig.applied(), -1.0);
  EXPECT_EQ(rig.lines.size(), 2u) << rig.said();
}

TEST(JointLimiter, PositionBeyondSoftLimitIsClampedAndReported) {
  LimitRig rig({.name = "j 1", .lower = -1, .upper = 2}, "position");
  rig.manager->set_soft_limits({{.joint = "j 1", .lower = -0.5, .upper = 0.5}});
  rig.value = 0.9;
  rig.run(100);
  EXPECT_EQ(rig.applied(), 0.5);
  EXPECT_EQ(rig.count(Severity::warning,
                      "j 1: command 0.9 rad is outside the soft limits -0.5 to 0.5 rad of its "
                      "<safety_controller>; clamped to the soft limit"),
            1u)
      << rig.said();
  EXPECT_EQ(rig.lines.size(), 1u) << rig.said();
  rig.value = -0.3;
  rig.run(1);
  EXPECT_EQ(rig.applied(), -0.3);
}

// The definition of soft limits: no faster than k_position times the distance to the soft limit.
TEST(JointLimiter, SoftLimitIsApproachedEverSlower) {
  LimitRig rig({.name = "j 1", .lower = -1, .upper = 2, .velocity = 1}, "position");
  rig.manager->set_soft_limits({{.joint = "j 1", .lower = -0.5, .upper = 0.5, .k_position = 5}});
  rig.value = 0.0;
  rig.run(1);
  rig.value = 0.9;
  const double dt = to_seconds(rig.manager->period());
  double before = 0;
  for (int i = 0; i < 400; ++i) {
    rig.run(1);
    EXPECT_LE(rig.applied() - before, std::min(1.0, 5 * (0.5 - before)) * dt + 1e-12);
    before = rig.applied();
  }
  EXPECT_NEAR(before, 0.5, 1e-3);
  rig.value = 0.0;  // away from the limit, only the velocity limit counts
  rig.run(10);
  EXPECT_NEAR(rig.applied(), before - 10 * dt, 1e-9);
}

TEST(JointLimiter, SoftLimitBoundsVelocityByDistance) {
  LimitRig rig({.name = "j 1", .lower = -1, .upper = 2, .velocity = 1}, "velocity", "", 0.4);
  rig.manager->set_soft_limits({{.joint = "j 1", .lower = -0.5, .upper = 0.5, .k_position = 5}});
  rig.hardware->block("j 1");
  rig.value = 1.0;
  rig.run(1);
  EXPECT_NEAR(rig.applied(), 0.5, 1e-12);  // 5 (0.5 - 0.4)
  rig.value = -1.0;
  rig.run(1);
  EXPECT_EQ(rig.applied(), -1.0);
  rig.hardware->set_position("j 1", 0.6);
  rig.value = 0.2;
  rig.run(1);
  EXPECT_EQ(rig.applied(), 0.0);
}

TEST(JointLimiter, VelocityGainBoundsEffort) {
  LimitRig rig({.name = "j 1", .lower = -1, .upper = 2, .velocity = 1, .effort = 30}, "effort", "", 0.3);
  rig.manager->set_soft_limits(
      {{.joint = "j 1", .lower = -0.5, .upper = 0.5, .k_position = 5, .k_velocity = 10}});
  rig.hardware->set_velocity("j 1", 0.75);
  rig.value = 20;
  rig.run(1);
  EXPECT_NEAR(rig.applied(), -10 * (0.75 - 1.0), 1e-12);  // v_max = min(1, 5 (0.5 - 0.3))
  rig.hardware->set_position("j 1", 0.45);
  rig.run(1);
  EXPECT_NEAR(rig.applied(), -10 * (0.75 - 0.25), 1e-12);  // it brakes
  rig.value = -3;
  rig.hardware->set_velocity("j 1", 0);
  rig.run(1);
  EXPECT_EQ(rig.applied(), -3.0);
}

TEST(SoftLimits, OnlyEnforceableOnesAreTakenAndOthersReported) {
  const Model model = fake_robot({{.name = "good", .lower = -1, .upper = 1},
                                  {.name = "wheel", .type = JointType::continuous},
                                  {.name = "turned", .lower = -1, .upper = 1},
                                  {.name = "brake", .type = JointType::continuous}});
  RobotDescription robot;
  const auto add = [&](const std::string& name, SafetyController safety) {
    Joint joint;
    joint.name = name;
    joint.type = model.joints[static_cast<std::size_t>(model.find_joint(name))].type;
    joint.safety = std::move(safety);
    robot.joints.push_back(std::move(joint));
  };
  add("good", {-0.5, 3, 10, 2, make_location("r.urdf", 4, 1)});
  add("wheel", {-0.5, 0.5, 10, 2, make_location("r.urdf", 5, 1)});
  add("turned", {0.5, -0.5, 10, 2, make_location("r.urdf", 6, 1)});
  add("brake", {0, 0, 0, 2, make_location("r.urdf", 7, 1)});
  Diagnostics diagnostics;
  const auto limits = soft_limits_of(robot, model, diagnostics);
  ASSERT_EQ(limits.size(), 2u);
  EXPECT_EQ(limits[0].upper, 1.0) << "inside the limit";
  EXPECT_EQ(limits[0].lower, -0.5);
  EXPECT_FALSE(limits[1].bounds_position());
  EXPECT_EQ(limits[1].k_velocity, 2.0);
  ASSERT_EQ(diagnostics.all().size(), 2u);
  EXPECT_THAT(diagnostics.all()[0].str(), testing::HasSubstr("r.urdf:5:1"));
  EXPECT_THAT(diagnostics.all()[0].str(), testing::HasSubstr("a continuous joint has no range"));
  EXPECT_THAT(diagnostics.all()[1].str(), testing::HasSubstr("is not below"));
}

TEST(JointLimiter, TrajectoryFromJointOutsideIsClampedWithoutReport) {
  LimitRig rig({.name = "j 1", .lower = -1, .upper = 2}, "position", "", 2.0);
  rig.hardware->set_offset("j 1", 0.01);  // it sags under load
  rig.value = 2.01;
  rig.run(40);
  EXPECT_EQ(rig.applied(), 2.0);
  EXPECT_TRUE(rig.lines.empty()) << rig.said();
  rig.value = 2.02;
  rig.run(40);
  EXPECT_EQ(rig.count(Severity::warning, "outside the limits"), 1u) << rig.said();
}

TEST(JointLimiter, CommandOnLimitIsNotReported) {
  LimitRig rig({.name = "j 1", .lower = 0, .upper = 1.570796}, "position");
  rig.value = 1.5707963267948966;
  rig.run(100);
  EXPECT_EQ(rig.applied(), 1.570796);
  EXPECT_TRUE(rig.lines.empty()) << rig.said();
}

TEST(JointLimiter, PositionRateIsClampedToVelocityLimit) {
  LimitRig rig({.name = "j 1", .velocity = 0.2}, "position", "", 0.5);
  rig.value = 0.513;  // 1.3 rad/s from where it is
  rig.run(1);
  EXPECT_NEAR(rig.applied(), 0.502, 1e-12);
  rig.run(5);
  EXPECT_NEAR(rig.applied(), 0.512, 1e-12);
  rig.run(60);
  EXPECT_EQ(rig.applied(), 0.513);
  EXPECT_EQ(rig.count(Severity::warning,
                      "j 1: the position command requires 1.3 rad/s, above the velocity limit 0.2 rad/s; the "
                      "joint moves to it at the limit"),
            1u)
      << rig.said();
  EXPECT_EQ(rig.lines.size(), 1u);
}

TEST(JointLimiter, SlowControllerIsNotClamped) {
  LimitRig rig({.name = "j 1", .velocity = 1.0}, "position", "w: {ros__parameters: {update_rate: 25}}");
  rig.value = 0;
  rig.run(4);
  for (int update = 1; update <= 20; ++update) {
    rig.value = 0.04 * update;  // 1 rad/s at 25 Hz
    rig.run(4);
    EXPECT_NEAR(rig.applied(), rig.value, 1e-9);
  }
  EXPECT_TRUE(rig.lines.empty()) << rig.said();
}

TEST(JointLimiter, JointOutsideLimitsCanOnlyReturn) {
  LimitRig rig({.name = "j 1", .lower = -1, .upper = 1, .velocity = 1.0}, "position", "", 1.5);
  rig.value = 1.5;
  rig.run(1);
  EXPECT_NEAR(rig.applied(), 1.49, 1e-12);
  rig.run(100);
  EXPECT_EQ(rig.applied(), 1.0);
}

TEST(JointLimiter, ContinuousJointIsUnlimited) {
  LimitRig rig({.name = "j 1", .type = JointType::continuous}, "position");
  rig.value = 100;
  rig.run(1);
  EXPECT_EQ(rig.applied(), 100.0);
}

TEST(JointLimiter, VelocityAndEffortAreClamped) {
  LimitRig velocity({.name = "j 1", .lower = -100, .upper = 100, .velocity = 0.5}, "velocity");
  velocity.value = -3;
  velocity.run(40);
  EXPECT_EQ(velocity.applied(), -0.5);
  EXPECT_EQ(velocity.count(Severity::warning, "j 1: command -3 rad/s is above the limit 0.5 rad/s"), 1u)
      << velocity.said();
  LimitRig effort({.name = "j 1", .effort = 3.5}, "effort");
  effort.value = 12;
  effort.run(40);
  EXPECT_EQ(effort.applied(), 3.5);
  EXPECT_EQ(effort.count(Severity::warning, "j 1: command 12 N m is above the limit 3.5 N m"), 1u)
      << effort.said();
  LimitRig linear({.name = "j 1", .type = JointType::prismatic, .effort = 3.5}, "effort");
  linear.value = 12;
  linear.run(40);
  EXPECT_EQ(linear.count(Severity::warning, "command 12 N is above the limit 3.5 N;"), 1u) << linear.said();
}

TEST(JointLimiter, VelocityIsClampedAtPositionLimit) {
  LimitRig rig({.name = "j 1", .lower = -1, .upper = 1}, "velocity");
  rig.value = 0.5;
  rig.run(400);
  EXPECT_NEAR(rig.hardware->position("j 1"), 1.0, 1e-9);
  EXPECT_EQ(rig.count(Severity::warning, "at the end of the range"), 1u) << rig.said();
  rig.value = -0.5;
  rig.run(100);
  EXPECT_NEAR(rig.hardware->position("j 1"), 0.5, 1e-9);
}

TEST(JointLimiter, NanKeepsLastGoodCommand) {
  LimitRig rig({.name = "j 1"}, "position");
  rig.run(5);
  EXPECT_TRUE(std::isnan(rig.applied()));  // no command yet, which is not reported
  EXPECT_TRUE(rig.lines.empty());
  rig.value = 0.7;
  rig.run(5);
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    rig.value = bad;
    rig.run(10);
    EXPECT_EQ(rig.applied(), 0.7);
    EXPECT_EQ(rig.manager->command("j 1/position"), 0.7);
  }
  EXPECT_EQ(rig.count(Severity::warning, "'j 1/position' is not a finite number"), 1u) << rig.said();
  rig.value = 0.8;
  rig.run(1);
  EXPECT_EQ(rig.applied(), 0.8);
}

TEST(JointLimiter, DisabledLimiterStillRefusesNan) {
  LimitRig rig({.name = "j 1", .upper = 1}, "position",
               "/**: {ros__parameters: {enforce_command_limits: false}}");
  rig.value = 2;
  rig.run(1);
  EXPECT_EQ(rig.applied(), 2.0);
  rig.value = kNaN;
  rig.run(1);
  EXPECT_EQ(rig.applied(), 2.0);
}

}  // namespace
}  // namespace doppel
