#include "doppel/review/calibration/calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "doppel/base/core/diagnostic.h"
#include "doppel/review/calibration/lerobot.h"

namespace doppel {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Joint revolute(const std::string& name) {
  Joint joint;
  joint.name = name;
  joint.type = JointType::revolute;
  joint.limits = JointLimits{};
  joint.limits->lower = 0;
  joint.limits->upper = std::numbers::pi;
  joint.limits->has_position = true;
  return joint;
}

std::vector<Measurement> degrees(std::initializer_list<std::pair<double, double>> pairs) {
  std::vector<Measurement> out;
  for (const auto& [model, machine] : pairs) out.push_back({model * kDegree, machine * kDegree});
  return out;
}

std::string refused(const Joint& joint, const std::vector<Measurement>& measurements) {
  try {
    fit_joint(joint, measurements);
  } catch (const InputError& problem) {
    return problem.diagnostics().front().rule;
  }
  return "accepted";
}

TEST(Calibration, WalkthroughJointTwoIsCorrected) {
  const auto measured = degrees({{0, 45}, {90, 135}});
  const JointFit fit = fit_joint(revolute("Revolute 2"), measured);
  EXPECT_EQ(fit.direction, 1);
  EXPECT_NEAR(fit.scale, 1.0, 1e-12);
  EXPECT_NEAR(fit.offset, 45 * kDegree, 1e-12);
  EXPECT_NEAR(fit.worst_residual(), 0, 1e-12);
  const auto operations = calibration_operations(revolute("Revolute 2"), fit, measured, LimitChoice::keep);
  ASSERT_EQ(operations.size(), 1u);
  EXPECT_NEAR(std::get<BakeZero>(operations[0].action).offset, 45 * kDegree, 1e-12);
  EXPECT_EQ(operations[0].evidence.size(), 2u);
}

TEST(Calibration, MirroredJointIsFlippedBeforeItsZeroIsBaked) {
  const auto measured = degrees({{0, 180}, {60, 120}, {90, 90}});
  const JointFit fit = fit_joint(revolute("j"), measured);
  EXPECT_EQ(fit.direction, -1);
  const auto operations = calibration_operations(revolute("j"), fit, measured, LimitChoice::move);
  ASSERT_EQ(operations.size(), 3u);
  EXPECT_TRUE(std::holds_alternative<FlipAxis>(operations[0].action));
  EXPECT_NEAR(std::get<BakeZero>(operations[1].action).offset, std::numbers::pi, 1e-12);
  const auto& moved = std::get<SetLimit>(operations[2].action);
  EXPECT_NEAR(*moved.lower, 0, 1e-12);
  EXPECT_NEAR(*moved.upper, std::numbers::pi, 1e-12);
}

TEST(Calibration, CorrectJointNeedsNoOperation) {
  const auto measured = degrees({{0, 0}, {90, 90}});
  EXPECT_TRUE(
      calibration_operations(revolute("j"), fit_joint(revolute("j"), measured), measured, LimitChoice::move)
          .empty());
}

TEST(Calibration, AmbiguousMeasurementsAreRefused) {
  const Joint joint = revolute("j");
  EXPECT_EQ(refused(joint, degrees({{90, 110}})), "calibrate.too_few");
  EXPECT_EQ(refused(joint, {}), "calibrate.too_few");
  EXPECT_EQ(refused(joint, degrees({{0, 45}, {59, 104}})), "calibrate.too_close");
  EXPECT_EQ(refused(joint, degrees({{0, 45}, {60, 105}})), "accepted");
  EXPECT_EQ(refused(joint, degrees({{0, 45}, {90, 45}})), "calibrate.no_motion");
  EXPECT_EQ(refused(joint, degrees({{0, 0}, {60, 90}, {120, 120}})), "calibrate.inconsistent");
  Joint follower = joint;
  follower.mimic = Mimic{"leader", 1, 0, {}};
  EXPECT_EQ(refused(follower, degrees({{0, 0}, {90, 90}})), "calibrate.mimic");
  Joint fixed = joint;
  fixed.type = JointType::fixed;
  EXPECT_EQ(refused(fixed, degrees({{0, 0}, {90, 90}})), "calibrate.no_position");
}

// Measurements on any line are fitted by that line, and noise appears only as residuals.
TEST(Calibration, FitFindsMeasuredLine) {
  const unsigned seed = 11;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> scale(0.8, 1.2), offset(-3, 3), angle(-1.5, 1.5),
      noise(-0.005, 0.005);
  for (int round = 0; round < 500; ++round) {
    const double k = scale(random) * (round % 2 == 0 ? 1 : -1), d = offset(random);
    std::vector<Measurement> measured{{-1.5, -1.5 * k + d}, {1.5, 1.5 * k + d}};
    for (int i = 0; i < 4; ++i) {
      const double model = angle(random);
      measured.push_back({model, model * k + d});
    }
    const JointFit exact = fit_joint(revolute("j"), measured);
    EXPECT_NEAR(exact.direction * exact.scale, k, 1e-12);
    EXPECT_NEAR(exact.offset, d, 1e-12);
    for (Measurement& m : measured) m.machine += noise(random);
    const JointFit noisy = fit_joint(revolute("j"), measured);
    EXPECT_NEAR(noisy.direction * noisy.scale, k, 0.01);
    double sum = 0;
    for (const double residual : noisy.residuals) sum += residual;
    EXPECT_NEAR(sum, 0, 1e-12) << "expected residuals of a least-squares fit, with a sum of zero";
  }
}

TEST(Calibration, MeasurementFormatsAreRead) {
  RobotDescription robot;
  robot.joints = {revolute("Revolute 2"), revolute("arm:left")};
  Joint slide = revolute("slide");
  slide.type = JointType::prismatic;
  robot.joints.push_back(slide);
  const auto two = parse_measurements("Revolute 2: 0=45  90=135", robot);
  EXPECT_EQ(two.joint, "Revolute 2");
  ASSERT_EQ(two.measurements.size(), 2u);
  EXPECT_NEAR(two.measurements[1].machine, 135 * kDegree, 1e-12);
  EXPECT_EQ(parse_measurements("arm:left:-10=20,80=1e2", robot).measurements.size(), 2u);
  EXPECT_NEAR(parse_measurements("slide: 0=5 100=105", robot).measurements[1].model, 0.1, 1e-12);
  for (const char* bad : {"Revolute 2", "Revolute 2:", "Revolute 2: 0:45", "Revolute 2: 0=x",
                          "Revolute 2: 0,5=1", "Revolute 22: 0=1 90=91", "Revolute 2: nan=1 90=91"}) {
    EXPECT_THROW(parse_measurements(bad, robot), InputError) << bad;
  }
}

std::vector<Operation> corrections(const Joint& joint, const std::vector<Measurement>& measurements) {
  return calibration_operations(joint, fit_joint(joint, measurements), measurements, LimitChoice::keep);
}

TEST(Calibration, MeasurementsOfUncorrectedModelAreReported) {
  const Joint joint = revolute("J");
  const std::vector<Operation> made = corrections(joint, degrees({{0, 45}, {90, 135}}));
  const auto repeats = [&](const std::vector<Measurement>& again) {
    return correction_made_of(made, "J", corrections(joint, again)).has_value();
  };
  EXPECT_TRUE(repeats(degrees({{0, 45}, {90, 135}})));
  EXPECT_TRUE(repeats(degrees({{90, 135}, {0, 45}})))
      << "expected a repetition: the same measurements in another order";
  EXPECT_TRUE(repeats(degrees({{0, 45}, {60, 105}}))) << "expected a repetition: one measurement is the same";
  EXPECT_TRUE(repeats(degrees({{10, 56}, {80, 125}})))
      << "expected a repetition: other measurements of the same model";
  EXPECT_FALSE(repeats(degrees({{45, 47}, {135, 137}})))
      << "expected no repetition: measurements of the corrected model";
  EXPECT_FALSE(correction_made_of(made, "K", corrections(joint, degrees({{0, 45}, {90, 135}}))));
}

TEST(Calibration, CorrectedJointIsNotRevertedByOldMeasurements) {
  const Joint joint = revolute("J");
  std::vector<Operation> made = corrections(joint, degrees({{0, 0}, {90, -90}}));
  ASSERT_EQ(made.size(), 1U);
  Operation renaming;
  renaming.action = Rename{"joint", "J", "elbow"};
  made.push_back(renaming);
  const std::vector<Operation> again = corrections(joint, degrees({{10, -11}, {80, -79}}));
  EXPECT_EQ(correction_made_of(made, "elbow", again), 0U)
      << "expected the correction to be found by the joint's new name";
  EXPECT_EQ(zeros_of(made, "elbow"), std::vector<std::size_t>{0});
  EXPECT_TRUE(zeros_of(made, "J").empty());
}

TEST(Calibration, MachineThatCountsTo360IsRecognised) {
  const Joint joint = revolute("J");
  const auto says = [&](const std::vector<Measurement>& measurements) -> std::string {
    try {
      fit_joint(joint, measurements);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(says(degrees({{0, 350}, {90, 80}})), testing::HasSubstr("\"J: 0=-10 90=80\""));
  EXPECT_THAT(says(degrees({{0, 10}, {90, 280}})), testing::HasSubstr("360"));
  EXPECT_THAT(says(degrees({{0, 350}, {60, 50}, {120, 110}})), testing::HasSubstr("0=-10 60=50 120=110"));
  EXPECT_EQ(says(degrees({{0, 10}, {90, 190}})).find("360"), std::string::npos)
      << "expected no mention of 360: a full turn does not explain this";
  const JointFit off = fit_joint(joint, degrees({{0, 350}, {200, 190}}));
  ASSERT_EQ(off.unwrapped.size(), 2U)
      << "expected the jump at 360 to be detected: it explains a scale of 0.8";
  EXPECT_NEAR(off.unwrapped[0], -10 * kDegree, 1e-9);
}

TEST(Lerobot, CurrentFormatIsRead) {
  const auto motors = parse_lerobot_calibration(
      R"({"shoulder_pan": {"id": 1, "drive_mode": 0, "homing_offset": -1046, "range_min": 743, "range_max": 3437}})",
      "c.json");
  ASSERT_EQ(motors.size(), 1u);
  EXPECT_EQ(motors[0].name, "shoulder_pan");
  EXPECT_NEAR(motors[0].angle(2090), 0, 1e-12);
  EXPECT_NEAR(motors[0].upper(), 1347.0 * 2 * std::numbers::pi / 4095, 1e-12);
  EXPECT_NEAR(motors[0].lower(), -motors[0].upper(), 1e-12);
}

TEST(Lerobot, OlderFormatIsRead) {
  const auto motors = parse_lerobot_calibration(
      R"({"homing_offset": [2048, -1024], "drive_mode": [1, 0], "start_pos": [2015, 1058], "end_pos": [-1024, 2048],
          "calib_mode": ["DEGREE", "DEGREE"], "motor_names": ["shoulder_pan", "shoulder_lift"]})",
      "c.json");
  ASSERT_EQ(motors.size(), 2u);
  EXPECT_NEAR(motors[0].angle(2048), 0, 1e-12);
  EXPECT_NEAR(motors[1].angle(2048), std::numbers::pi / 2, 1e-12);
}

TEST(Lerobot, OtherFormatIsRefused) {
  for (const char* bad :
       {"", "{", "[]", "{}", R"({"a": 1})", R"({"a": {"id": 1}})",
        R"({"motor_names": ["a"], "homing_offset": []})",
        R"({"a": {"id": 1, "drive_mode": 0, "homing_offset": 0, "range_min": 7, "range_max": 7}})",
        R"({"a": {"id": 1, "drive_mode": 0, "homing_offset": 0.5, "range_min": 7, "range_max": 9}})"}) {
    EXPECT_THROW(parse_lerobot_calibration(bad, "c.json"), InputError) << bad;
  }
}

}  // namespace
}  // namespace doppel
