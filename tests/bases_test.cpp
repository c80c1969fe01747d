// The bundled mobile robots: each stands on its wheels, drives by the controllers of its own YAML, and is where its
// odometry says; Kate against closed forms and in her lab.
#include <array>
#include <cmath>
#include <cstring>
#include <iostream>
#include <numbers>

#include "doppel/lab/base_report/base_report.h"
#include "doppel/ros/messages/nav_msgs.h"
#include "doppel/scenario/compile/rolling_report.h"
#include "twin_fixture.h"

namespace doppel {
namespace {

constexpr double kPi = std::numbers::pi;

struct Planar {
  double x = 0, y = 0, heading = 0;  // m, rad; the heading counts turns
};

// A base that drives by a topic.
class DrivingFixture : public test::TwinFixture {
 protected:
  void bring_up_base(const std::string& robot, const std::string& world = "", double x = 0, double y = 0) {
    Scenario scenario;
    WorldRobot asked{.target = robot};
    Pose X_WR = Pose::Identity();
    X_WR.translation() << x, y, 0;
    if (x != 0 || y != 0) asked.X_WR = X_WR;
    scenario.robots = {asked};
    if (!world.empty()) scenario.world = std::string(DOPPEL_SOURCE_DIR "/worlds/") + world;
    bring_up(scenario);
    turned_ = 0;
    run(1.0);
  }
  [[nodiscard]] Instance base() const { return twin_->robot().instance(); }
  Planar truth() {
    const Pose X = base().base_pose();
    const double heading = std::atan2(X.linear()(1, 0), X.linear()(0, 0));
    turned_ += std::remainder(heading - turned_, 2 * kPi);
    return {X.translation().x(), X.translation().y(), turned_};
  }
  // Commands this velocity for a time, at 20 Hz.
  void drive(double seconds, double vx, double wz, double vy = 0) {
    const std::string topic = topic_;
    for (int i = 0; i < static_cast<int>(seconds * 20 + 0.5); ++i) {
      publish(topic, "geometry_msgs/msg/TwistStamped",
              "{twist: {linear: {x: " + std::to_string(vx) + ", y: " + std::to_string(vy) +
                  "}, angular: {z: " + std::to_string(wz) + "}}}");
      run(0.05);
      truth();
    }
  }
  void stop() {
    drive(1.5, 0, 0);
    run(0.5);
  }
  template <typename Done>
  void drive_until(double vx, double wz, const Done& done) {
    for (int i = 0; i < 2000 && !done(); ++i) drive(0.05, vx, wz);
    stop();
  }

  std::string topic_ = "/base_controller/cmd_vel";
  double turned_ = 0;
};

struct BundledBase {
  std::string robot, topic;
  int wheels = 0, casters = 0;
  bool turns_on_spot = true;
};

std::ostream& operator<<(std::ostream& out, const BundledBase& base) {
  return out << base.robot;
}

class BundledBases : public DrivingFixture, public testing::WithParamInterface<BundledBase> {};

TEST_P(BundledBases, StandsDrivesOneMetreAndTurns) {
  const BundledBase& of = GetParam();
  topic_ = of.topic;
  bring_up_base(of.robot);
  const RollingReport report = report_rolling(base());
  int wheels = 0, casters = 0;
  double load = 0;
  for (const RollingLoad& part : report.parts) {
    ++(part.part.kind == RollingPart::Kind::wheel ? wheels : casters);
    load += part.load;
  }
  EXPECT_EQ(wheels, of.wheels);
  EXPECT_EQ(casters, of.casters);
  EXPECT_NEAR(load, 9.81 * base().model().total_mass, 0.02 * load) << "expected it to stand on them alone";
  EXPECT_GT(base().base_pose().linear()(2, 2), 0.9995) << "expected it upright";
  const Planar start = truth();
  drive_until(0.2, 0, [&] { return truth().x - start.x > 0.97; });
  const Planar ahead = truth();
  EXPECT_NEAR(ahead.x - start.x, 1.0, 0.08);
  EXPECT_NEAR(ahead.y - start.y, 0.0, 0.02);
  EXPECT_NEAR(ahead.heading - start.heading, 0.0, 0.02);
  drive_until(of.turns_on_spot ? 0.0 : 0.3, 0.5, [&] { return truth().heading - ahead.heading > 1.5; });
  EXPECT_NEAR(truth().heading - ahead.heading, kPi / 2, 0.2);
  EXPECT_GT(base().base_pose().linear()(2, 2), 0.9995);
}

INSTANTIATE_TEST_SUITE_P(Robots, BundledBases,
                         testing::Values(BundledBase{"turtle", "/base_controller/cmd_vel", 2, 1},
                                         BundledBase{"kate", "/base_controller/cmd_vel", 3, 0},
                                         BundledBase{"rover_skid", "/base_controller/cmd_vel", 4, 0},
                                         BundledBase{"rover_mecanum", "/base_controller/reference", 4, 0},
                                         BundledBase{"ackermann_car", "/base_controller/reference", 4, 0,
                                                     false}),
                         [](const testing::TestParamInfo<BundledBase>& of) { return of.param.robot; });

class SkidBase : public DrivingFixture {
 protected:
  // The way of the left and the right wheels, m.
  [[nodiscard]] std::array<double, 2> ways() const {
    return {0.05 * (joint("front_left_wheel_joint").q + joint("rear_left_wheel_joint").q),
            0.05 * (joint("front_right_wheel_joint").q + joint("rear_right_wheel_joint").q)};
  }
};

TEST_F(SkidBase, MultiplierOfReportIsThatOfFullTurn) {
  bring_up_base("rover_skid");
  const std::array<double, 2> before = ways();
  const double start = truth().heading;
  drive_until(0, 0.8, [&] { return truth().heading - start > 2 * kPi; });
  const std::array<double, 2> after = ways();
  const double by_wheels = (after[1] - before[1] - after[0] + before[0]) / 0.44;
  const double wanted = by_wheels / (truth().heading - start);

  Scenario scenario;
  scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
  scenario.robots = {{.target = "rover_skid"}};
  const BaseReport report = report_base(scenario, {}, diagnostics_);
  ASSERT_TRUE(report.fitted.has_value());
  std::cout << "a turn of 360 degrees asks for " << wanted << ", the report for " << report.fitted->separation
            << '\n';
  EXPECT_NEAR(report.fitted->separation, wanted, 0.01 * wanted);
  EXPECT_GT(wanted, 1.3) << "expected a base that scrubs";
  for (const double error : report.square_error_fitted) EXPECT_LT(error, 0.02);
}

class Kate : public DrivingFixture {
 protected:
  void SetUp() override {}
  [[nodiscard]] double wheel(const char* side) const { return joint(std::string(side) + "_wheel_joint").q; }
};

TEST_F(Kate, FiveMetresStraightHaveLessSlipThanHalfPerMille) {
  bring_up_base("kate");
  const Planar start = truth();
  const double left = wheel("left"), right = wheel("right");
  drive_until(0.6, 0, [&] { return truth().x - start.x > 4.6; });
  const double rolled = 0.0975 * (wheel("left") - left + wheel("right") - right) / 2;
  std::cout << "slip " << 100 * (1 - (truth().x - start.x) / rolled) << " %\n";
  EXPECT_NEAR((truth().x - start.x) / rolled, 1.0, 5e-4);
}

TEST_F(Kate, TenRadiansOnSpotAgreeWithMultiplierOfHerControllers) {
  bring_up_base("kate");
  for (const double direction : {1.0, -1.0}) {
    drive(1.0, 0, direction);  // the caster swivels
    const double start = truth().heading, left = wheel("left"), right = wheel("right");
    drive_until(0, direction, [&] { return std::abs(truth().heading - start) > 9.5; });
    const double by_wheels = 0.0975 * ((wheel("right") - right) - (wheel("left") - left)) / (0.33 * 1.08);
    std::cout << "turned " << truth().heading - start << " rad, by the wheels " << by_wheels << '\n';
    EXPECT_NEAR(by_wheels / (truth().heading - start), 1.0, 0.01);
  }
}

// UMBmark, Borenstein and Feng 1994: squares of 4 m in both directions, steered by the odometry alone. Where it says
// that she is, she is.
TEST_F(Kate, SquaresBothWaysEndWhereOdometrySays) {
  for (const double direction : {1.0, -1.0}) {
    bring_up_base("kate");
    listen("/base_controller/odom");
    Planar odometry;
    const auto look = [&] {
      for (const auto& message : received<nav_msgs::msg::Odometry>("/base_controller/odom")) {
        const auto& q = message.pose.pose.orientation;
        const double heading = 2 * std::atan2(q.z, q.w);
        odometry.heading += std::remainder(heading - odometry.heading, 2 * kPi);
        odometry.x = message.pose.pose.position.x;
        odometry.y = message.pose.pose.position.y;
      }
    };
    const Planar start = truth();
    double corner_x = 0, corner_y = 0;
    for (int side = 0; side < 4; ++side) {
      drive_until(0.5, 0, [&] {
        look();
        return std::hypot(odometry.x - corner_x, odometry.y - corner_y) > 3.8;
      });
      look();
      corner_x = odometry.x;
      corner_y = odometry.y;
      drive_until(0, direction, [&] {
        look();
        return std::abs(odometry.heading) > (side + 1) * kPi / 2 - 0.15;
      });
    }
    run(0.1);
    look();
    const Planar end = truth();
    const double error = std::hypot(end.x - start.x - odometry.x, end.y - start.y - odometry.y);
    std::cout << "after a square of 4 m she is " << 1e3 * error << " mm from where the odometry says\n";
    EXPECT_GT(std::abs(odometry.heading), 6.0);
    EXPECT_LT(error, 0.010);
  }
}

TEST_F(Kate, CasterSwivelsOnceAfterReversal) {
  bring_up_base("kate");
  drive(3.0, 0.3, 0);
  EXPECT_NEAR(std::remainder(joint("caster_swivel_joint").q, 2 * kPi), 0.0, 0.05);
  double turned = 0, before = joint("caster_swivel_joint").q;
  for (int i = 0; i < 120; ++i) {
    drive(0.05, -0.3, 0.001);
    turned += std::abs(joint("caster_swivel_joint").q - before);
    before = joint("caster_swivel_joint").q;
  }
  EXPECT_NEAR(std::abs(std::remainder(before, 2 * kPi)), kPi, 0.05);
  EXPECT_LT(turned, 1.2 * kPi) << "expected it to swing over once, without oscillation";
  EXPECT_LT(std::abs(joint("caster_swivel_joint").v), 0.01);
}

TEST_F(Kate, PushesLightTableAndNotHeavyOne) {
  for (const bool light : {true, false}) {
    bring_up_base("kate", "kate_lab.sdf", 0, light ? 0.0 : -1.6);
    const auto table = twin_->engine().find(light ? "light_table" : "heavy_table");
    ASSERT_TRUE(table.has_value());
    const Eigen::Vector3d before = table->base_pose().translation();
    drive(10.0, 0.2, 0);
    const Eigen::Vector3d after =
        twin_->engine().find(light ? "light_table" : "heavy_table")->base_pose().translation();
    std::cout << (light ? "light" : "heavy") << " table moved " << (after - before).transpose()
              << " m, Kate at " << truth().x << '\n';
    if (light) {
      EXPECT_GT(after.x() - before.x(), 0.3);
    } else {
      EXPECT_LT((after - before).norm(), 0.01);
    }
    EXPECT_GT(base().base_pose().linear()(2, 2), 0.999) << "expected her upright";
  }
}

// What one robot does alone, it does beside another one that it does not touch.
TEST_F(Kate, TwoKatesAreEachBitIdenticalToOneAlone) {
  const auto state_of = [this](const std::vector<WorldRobot>& robots, const std::string& name) {
    Scenario scenario;
    scenario.robots = robots;
    bring_up(scenario);
    run(0.5);
    for (int i = 0; i < 40; ++i) {
      for (const WorldRobot& robot : robots) {
        publish("/" + robot.name_space + "/base_controller/cmd_vel", "geometry_msgs/msg/TwistStamped",
                robot.name_space == "a" ? "{twist: {linear: {x: 0.3}, angular: {z: 0.4}}}"
                                        : "{twist: {linear: {x: -0.2}, angular: {z: 0.7}}}");
      }
      run(0.05);
    }
    const Instance of = twin_->find_robot(name)->instance();
    std::vector<double> out(of.q().begin(), of.q().end());
    out.insert(out.end(), of.v().begin(), of.v().end());
    return out;
  };
  const auto kate = [](const std::string& name, double y) {
    WorldRobot out{.target = "kate", .name_space = name};
    out.X_WR = Pose::Identity();
    out.X_WR->translation() << 0, y, 0;
    return out;
  };
  const WorldRobot a = kate("a", 0), b = kate("b", 3);
  for (const WorldRobot& alone : {a, b}) {
    const std::vector<double> together = state_of({a, b}, alone.name_space);
    const std::vector<double> single = state_of({alone}, alone.name_space);
    ASSERT_EQ(together.size(), single.size());
    EXPECT_EQ(0, std::memcmp(together.data(), single.data(), single.size() * sizeof(double)))
        << alone.name_space;
  }
}

}  // namespace
}  // namespace doppel
