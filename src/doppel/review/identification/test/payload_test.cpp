#include "doppel/review/identification/payload.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "doppel/base/core/diagnostic.h"
#include "doppel/review/identification/motion_plan.h"
#include "doppel/review/identification/test/drawn_servo.h"
#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

using Quantity = ServoQuantity;
using ::testing::HasSubstr;

Model pendulum_model() {
  Diagnostics diagnostics;
  return compile_model(test::make_pendulum(1.0, 0.5), BaseKind::fixed, diagnostics);
}

std::string complaint(const std::function<void()>& work) {
  try {
    work();
  } catch (const InputError& problem) {
    return problem.what();
  }
  return "accepted";
}

TEST(Payload, TextsWithUnitsAndPlaceAreRead) {
  EXPECT_DOUBLE_EQ(read_payload("200 g", "").mass, 0.2);
  const Payload placed = read_payload("0.5kg@0,-10 mm,0.06", "tool");
  EXPECT_DOUBLE_EQ(placed.mass, 0.5);
  EXPECT_TRUE(placed.p_LoC_L.isApprox(Eigen::Vector3d(0, -0.01, 0.06)));
  EXPECT_EQ(placed.link, "tool");
  EXPECT_EQ(payload_text(placed), "0.5@0,-0.01,0.06");
  for (const char* text : {"", "heavy", "-1", "0", "0.2@1,2", "0.2@1,2,3,4", "5 m", "nan"})
    EXPECT_THAT(complaint([&] { read_payload(text, ""); }), HasSubstr("is not a payload")) << text;
}

TEST(Payload, IsInWeightAndInertiaOfLoadedModel) {
  const Model model = pendulum_model();
  const Payload payload = read_payload("200g@0,0,-0.8", "bob");
  const Model loaded = loaded_model(model, payload);
  Data data(model);
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(1, 0.7);
  gravity_torques(loaded, data, q, {0, 0, -9.81});
  EXPECT_NEAR(data.tau[0], 9.81 * std::sin(0.7) * (1.0 * 0.5 + 0.2 * 0.8), 1e-9);
  mass_matrix(loaded, data, q);
  EXPECT_NEAR(data.M(0, 0), 1.0 * 0.25 + 1e-6 + 0.2 * 0.64, 1e-9);
  EXPECT_THAT(complaint([&] { loaded_model(model, read_payload("1", "bop")); }),
              HasSubstr("did you mean 'bob'?"));
}

TEST(Payload, BagNamesIt) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "payload_bag";
  std::filesystem::create_directories(folder);
  const auto write = [&](const std::string& data) {
    std::ofstream(folder / "metadata.yaml")
        << "rosbag2_bagfile_information:\n  version: 9\n  custom_data:" << data;
  };
  write(" ~\n");
  EXPECT_FALSE(recorded_payload(folder.string()).has_value());
  std::string text = "\n";
  for (const auto& [key, value] : payload_data(read_payload("0.2@0,0,0.06", "tool 0")))
    text += "    " + key + ": \"" + value + "\"\n";
  write(text);
  const auto payload = recorded_payload(folder.string());
  ASSERT_TRUE(payload.has_value());
  EXPECT_EQ(payload->link, "tool 0");
  EXPECT_DOUBLE_EQ(payload->mass, 0.2);
  EXPECT_FALSE(recorded_payload((folder / "none").string()).has_value());
}

// Behaviour 38 of the specification: a vertical axis alone has no scale, with a known weight it has.
TEST(Payload, FixesScaleOfVerticalAxis) {
  for (const std::uint64_t seed : {2U}) {
    DrawnServo servo = draw_servo(seed, FrictionRung::coulomb);
    servo.gravity = 0;
    const JointRecord bare = recording_of(servo);
    servo.inertia += 1.5 * servo.inertia + servo.values[static_cast<std::size_t>(Quantity::armature)];
    const JointRecord loaded = recording_of(servo);
    FitOptions options;
    options.start = servo.start;
    options.last = FrictionRung::coulomb;
    const ServoFit alone = fit_servo(bare, options);
    EXPECT_FALSE(alone.scale_known) << seed;
    EXPECT_THAT(alone[Quantity::stiffness].problem, HasSubstr("scale not identifiable")) << seed;
    EXPECT_THAT(alone[Quantity::stiffness].problem, HasSubstr("--payload 200g")) << seed;
    const ServoFit both = fit_servo(joined_records({bare, loaded}), options);
    EXPECT_TRUE(both.scale_known) << seed;
    for (const Quantity quantity :
         {Quantity::stiffness, Quantity::damping, Quantity::armature, Quantity::friction}) {
      const double truth = servo.values[static_cast<std::size_t>(quantity)];
      EXPECT_NEAR(both[quantity].value / truth, 1, 0.1) << seed << " " << name_of(quantity);
      EXPECT_TRUE(both[quantity].problem.empty()) << seed << " " << both[quantity].problem;
    }
  }
}

TEST(Payload, JoinedRecordsKeepSamplesAndTheirOrder) {
  const DrawnServo servo = draw_servo(3, FrictionRung::coulomb);
  const JointRecord one = recording_of(servo);
  const JointRecord both = joined_records({one, one});
  EXPECT_EQ(both.command.size(), 2 * one.command.size());
  EXPECT_LT(both.time.size(), 2 * one.time.size());
  EXPECT_GT(both.time.size(), 2 * one.time.size() - 60);
  EXPECT_EQ(both.load.size(), both.time.size());
  EXPECT_TRUE(std::ranges::is_sorted(both.time));
  EXPECT_TRUE(std::ranges::is_sorted(both.command_time));
  EXPECT_EQ(both.position.back(), one.position.back());
}

TEST(Payload, IsInEffortsOfPlanAndInItsFile) {
  RobotDescription robot = test::make_pendulum(1.0, 0.5);
  robot.joints[0].type = JointType::revolute;
  test::limit(robot.joints[0], -1, 1.2, 40, 4);
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  PlanOptions options;
  options.seconds = 30;
  options.q = model.neutral();
  const MotionPlan bare = plan_motion(robot, model, options);
  options.payload = read_payload("1 kg@0,0,-0.5", "bob");
  const MotionPlan loaded = plan_motion(robot, model, options);
  EXPECT_GT(loaded.joints.at(0).effort, 1.3 * bare.joints.at(0).effort);
  EXPECT_EQ(loaded.arm, bare.arm) << "it is the same arm";
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "loaded_plan.yaml";
  std::ofstream(file) << to_yaml(loaded);
  const MotionPlan read = read_motion_plan(file);
  ASSERT_TRUE(read.payload.has_value());
  EXPECT_EQ(payload_text(*read.payload), payload_text(*options.payload));
  EXPECT_EQ(read.payload->link, "bob");
  std::ofstream(file) << to_yaml(bare);
  EXPECT_FALSE(read_motion_plan(file).payload.has_value());
}

}  // namespace
}  // namespace doppel
