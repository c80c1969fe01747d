// Force-torque sensors that carry known weights, against closed forms.
#include <cmath>

#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/ros_gz_interfaces.h"
#include "physical_fixture.h"

namespace doppel {
namespace {

using geometry_msgs::msg::WrenchStamped;
using test::Sensed;
using test::vector_of;

constexpr double kWeight = 9.81, kArm = 0.2;

// A kilogram whose centre of mass is kArm along x of the last link. `wrist`: of the joint before it; its frame is turned
// by 90 degrees about x in that of the parent, so that gravity is along -y of the child.
RobotDescription balance(JointType wrist) {
  RobotDescription robot;
  robot.name = "balance";
  robot.links = {test::make_frame("base"), test::make_link("hand", 1, {kArm, 0, 0}, {1e-3, 1e-3, 1e-3})};
  robot.joints = {test::make_joint("wrist", wrist, "base", "hand", {0, 0, 1}, {0, 0, 1})};
  robot.joints[0].origin.rpy = {M_PI / 2, 0, 0};
  if (wrist != JointType::fixed) test::limit(robot.joints[0], -3, 3, 100, 10);
  return robot;
}

RigSensor wrench_on(const std::string& instance, const std::string& link, int index, const std::string& name,
                    const ForceTorqueDescription& what = {}) {
  RigSensor sensor = test::make_rig_sensor(instance, link, index, name, 100);
  sensor.description.type = "force_torque";
  sensor.description.what = what;
  return sensor;
}

ForceTorqueDescription in_frame(WrenchFrame frame, bool parent_to_child) {
  ForceTorqueDescription out;
  out.frame = frame;
  out.parent_to_child = parent_to_child;
  return out;
}

void expect_vector(const geometry_msgs::msg::Vector3& found, const Eigen::Vector3d& expected,
                   double within = 1e-6) {
  EXPECT_LT((vector_of(found) - expected).norm(), within)
      << vector_of(found).transpose() << " instead of " << expected.transpose();
}

// The last message after half a second of standing still.
WrenchStamped weighed(RigSensor sensor, JointType wrist = JointType::fixed) {
  Sensed twin(balance(wrist), test::empty_space(), {std::move(sensor)});
  twin.world.hold_all();
  twin.start();
  std::vector<WrenchStamped> readings;
  twin.read("/wrist", readings);
  twin.run(0.5);
  EXPECT_EQ(readings.size(), 50U);
  return readings.empty() ? WrenchStamped{} : readings.back();
}

TEST(WrenchOutput, HangingKilogramHasForceOfItsAxesAndDirection) {
  // The sensor is turned by 90 degrees about z in the child.
  const Pose X_LS = make_pose({0, 0, 0}, {0, 0, M_PI / 2});
  struct Case {
    WrenchFrame frame;
    Eigen::Vector3d up;
    std::string names;
  };
  for (const auto& [frame, up, names] :
       {Case{WrenchFrame::parent, {0, 0, 1}, "base"}, Case{WrenchFrame::child, {0, 1, 0}, "hand"},
        Case{WrenchFrame::sensor, {1, 0, 0}, "wrist_frame"}}) {
    for (const bool parent_to_child : {false, true}) {
      RigSensor sensor = wrench_on("balance", "hand", 1, "wrist", in_frame(frame, parent_to_child));
      sensor.description.X_LS = sensor.X_LF = X_LS;
      sensor.frame = "wrist_frame";
      const WrenchStamped found = weighed(sensor);
      // The parent holds the child up; the child pulls the parent down.
      expect_vector(found.wrench.force, (parent_to_child ? kWeight : -kWeight) * up);
      EXPECT_EQ(found.header.frame_id, names);
    }
  }
}

TEST(WrenchOutput, TorqueIsAboutOwnOriginOfSensor) {
  for (const double at : {0.0, 0.05, kArm, 0.3}) {
    RigSensor sensor = wrench_on("balance", "hand", 1, "wrist", in_frame(WrenchFrame::child, true));
    sensor.description.X_LS = sensor.X_LF = make_pose({at, 0, 0}, {0, 0, 0});
    const WrenchStamped found = weighed(sensor);
    // Up is y, and the centre of mass is kArm - at along x.
    expect_vector(found.wrench.torque, {0, 0, (kArm - at) * kWeight});
  }
}

TEST(WrenchOutput, MovingJointTransmitsSameWrenchAsFixedOne) {
  const RigSensor sensor = wrench_on("balance", "hand", 1, "wrist", in_frame(WrenchFrame::parent, true));
  const WrenchStamped fixed = weighed(sensor), held = weighed(sensor, JointType::revolute);
  expect_vector(fixed.wrench.force, {0, 0, kWeight});
  expect_vector(held.wrench.force, {0, 0, kWeight}, 1e-3);
  // The joint sags a little under the torque about its axis.
  expect_vector(held.wrench.torque, vector_of(fixed.wrench.torque), 1e-2 * kWeight * kArm);
}

TEST(WrenchOutput, FreelySwingingBobTransmitsItsCentripetalForce) {
  constexpr double kLength = 0.5, kSpeed = 3;
  Sensed twin(test::make_pendulum(1, kLength), test::empty_space(), {[] {
                RigSensor sensor =
                    wrench_on("pendulum", "bob", 1, "swing", in_frame(WrenchFrame::child, true));
                sensor.description.rate = 0;
                return sensor;
              }()});
  twin.world.set_state({0.0}, {kSpeed});
  twin.start();
  std::vector<WrenchStamped> readings;
  twin.read("/swing", readings);
  twin.step();
  ASSERT_EQ(readings.size(), 1U);
  expect_vector(readings[0].wrench.force, {0, 0, kWeight + kSpeed * kSpeed * kLength}, 1e-4);
  EXPECT_NEAR(readings[0].wrench.torque.y, 0, 1e-9);
}

// A plate on a fixed joint, 0.1 m high and 2 m above the ground plane of the world, with a sensor below it.
RobotDescription scale() {
  RobotDescription robot;
  robot.name = "scale";
  robot.links = {test::make_frame("foot"), test::make_link("plate", 0.5, {0, 0, 0}, {1e-2, 1e-2, 1e-2})};
  Collision plate;
  plate.geometry = Box{{1, 1, 0.1}};
  robot.links[1].collisions = {plate};
  robot.joints = {test::make_joint("load", JointType::fixed, "foot", "plate", {0, 0, 2}, {0, 0, 1})};
  return robot;
}

TEST(WrenchOutput, ContactsOfWhatIsBeyondAreCarried) {
  constexpr double kCube = 2;
  World world = test::empty_space();
  world.objects = {test::make_object("cube", Box{{0.2, 0.2, 0.2}}, {0.1, 0, 2.15}, kCube)};
  Sensed twin(scale(), world, {wrench_on("scale", "plate", 1, "load")});
  twin.start();
  std::vector<WrenchStamped> readings;
  twin.read("/load", readings);
  twin.run(1);
  ASSERT_EQ(readings.size(), 100U);
  expect_vector(readings.back().wrench.force, {0, 0, -(0.5 + kCube) * kWeight}, 1e-2);
  expect_vector(readings.back().wrench.torque, {0, 0.1 * kCube * kWeight, 0}, 1e-2);
}

// A ball that a torque about the vertical does not turn, because the torsion of its only contact holds it.
TEST(WrenchOutput, TorsionOfContactIsTransmittedInEquilibrium) {
  constexpr double kBall = 2, kTorque = 0.3;
  RobotDescription robot = scale();
  robot.links[1].collisions[0].surface.torsional_mu = 1;
  robot.links[1].collisions[0].surface.patch_radius = 0.05;
  World world = test::empty_space();
  world.objects = {test::make_object("ball", Sphere{0.1}, {0, 0, 2.15}, kBall)};
  RigSensor touch = test::make_rig_sensor("scale", "plate", 1, "touch", 100);
  touch.description.what = ContactDescription{};
  Sensed twin(robot, world, {wrench_on("scale", "plate", 1, "load"), touch});
  twin.start();
  std::vector<WrenchStamped> readings;
  std::vector<ros_gz_interfaces::msg::Contacts> touches;
  twin.read("/load", readings);
  twin.read("/touch", touches);
  Instance ball = twin.world.object("ball");
  ball.apply_wrench(ball.made_of().base_link(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                    {0, 0, kTorque});
  twin.run(1);
  ASSERT_EQ(readings.size(), 100U);
  expect_vector(readings.back().wrench.force, {0, 0, -(0.5 + kBall) * kWeight}, 1e-2);
  expect_vector(readings.back().wrench.torque, {0, 0, kTorque}, 1e-3);
  ASSERT_EQ(touches.back().contacts.size(), 1U);
  expect_vector(touches.back().contacts[0].wrenches.at(0).body_1_wrench.torque, {0, 0, kTorque}, 1e-3);
  expect_vector(touches.back().contacts[0].wrenches.at(0).body_2_wrench.torque, {0, 0, -kTorque}, 1e-3);
}

TEST(WrenchOutput, AttachedObjectCountsAsPartOfHand) {
  constexpr double kLoad = 0.7;
  World world = test::empty_space();
  world.objects = {test::make_object("load", Sphere{0.02}, {0.6, 0, 1}, kLoad)};
  Sensed twin(balance(JointType::fixed), world,
              {wrench_on("balance", "hand", 1, "wrist", in_frame(WrenchFrame::parent, true))});
  twin.start();
  // A fixed hand cannot be attached to a fixed base, but to a load that moves.
  ASSERT_TRUE(twin.world.engine->attach({0, 1}, {1, 1}));
  std::vector<WrenchStamped> readings;
  twin.read("/wrist", readings);
  twin.run(1);
  ASSERT_EQ(readings.size(), 100U);
  expect_vector(readings.back().wrench.force, {0, 0, (1 + kLoad) * kWeight}, 1e-2);
  EXPECT_NEAR(readings.back().wrench.torque.y, -(kArm + 0.6 * kLoad) * kWeight, 2e-2);
}

TEST(WrenchOutput, NoiseHasItsStandardDeviation) {
  ForceTorqueDescription what = in_frame(WrenchFrame::parent, true);
  what.force[2].stddev = 0.5;
  RigSensor sensor = wrench_on("balance", "hand", 1, "wrist", what);
  sensor.description.rate = 0;
  Sensed twin(balance(JointType::fixed), test::empty_space(), {sensor});
  twin.start();
  std::vector<WrenchStamped> readings;
  twin.read("/wrist", readings);
  twin.run(5);
  double sum = 0;
  for (const WrenchStamped& one : readings) sum += std::pow(one.wrench.force.z - kWeight, 2);
  EXPECT_NEAR(std::sqrt(sum / static_cast<double>(readings.size())), 0.5, 0.02);
  EXPECT_NEAR(readings.back().wrench.force.x, 0, 1e-6);
}

}  // namespace
}  // namespace doppel
