// The calibration of a machine whose servo has another zero and direction than the description.
#include "doppel/session/live/calibration_service.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>

#include "doppel/description/overlay/overlay.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using doppel_msgs::msg::Calibration;
using doppel_msgs::msg::JointCalibration;
using doppel_msgs::srv::ForgetMeasurements;
using doppel_msgs::srv::MeasureJoint;
using doppel_msgs::srv::WriteCalibration;
using std_srvs::srv::Trigger;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kArm = R"(<robot name="arm"><link name="base"/><link name="fore"/>
<joint name="lift" type="revolute"><parent link="base"/><child link="fore"/><axis xyz="0 0 1"/>
<limit lower="-1.9" upper="1.9" effort="2" velocity="5"/></joint></robot>)";
constexpr double kZero = 0.2;  // rad: what the servo reads at the model's zero

class CalibrationServiceTest : public testing::Test {
 protected:
  CalibrationServiceTest() : listener_(bus_, "/listener") {
    fs::create_directories(folder_);
    std::ofstream(file_) << kArm;
    listener_.subscribe<Calibration>("/doppel/calibration",
                                     [this](const Calibration& message) { state_ = message; });
    service_.emplace(bus_, CalibrationServiceOptions{[this] {
                                                       CalibratedRobot robot;
                                                       robot.source.target = file_.string();
                                                       for (const Joint& joint : load().joints)
                                                         robot.joints.push_back(joint);
                                                       return std::vector<CalibratedRobot>{robot};
                                                     },
                                                     [this](const std::string&, const std::string&) {
                                                       true_ += speed_;
                                                       return kZero - true_;
                                                     },
                                                     {}});
    edge_ = bus_.attach("edge");
    bus_.spin();
  }
  ~CalibrationServiceTest() override {
    edge_.reset();
    service_.reset();
    fs::remove_all(folder_);
  }

  RobotDescription load() {
    Diagnostics diagnostics;
    PackageResolver resolver;
    return load_corrected(file_, {}, resolver, diagnostics).robot;
  }

  template <class Srv>
  typename Srv::Response call(const std::string& service, const typename Srv::Request& request) {
    typename Srv::Response response;
    bool done = false;
    edge_->call(service, to_cdr(request), [&](const Status& status, const Bytes& cdr) {
      EXPECT_TRUE(status) << status.why();
      EXPECT_TRUE(from_cdr(cdr, response));
      done = true;
    });
    for (int i = 0; i < 10000 && !done; ++i) {
      bus_.spin();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_TRUE(done) << service;
    bus_.spin();
    return response;
  }
  // The arm stands at `pose`, and a person says so.
  MeasureJoint::Response measure(double pose, const std::string& joint = "lift") {
    true_ = pose;
    MeasureJoint::Request request;
    request.joint = joint;
    request.model = pose;
    return call<MeasureJoint>("/doppel/calibrate/measure", request);
  }
  WriteCalibration::Response write() { return call<WriteCalibration>("/doppel/calibrate/write", {}); }
  [[nodiscard]] const JointCalibration& lift() const { return state_.joints.at(0); }
  [[nodiscard]] fs::path overlay() const { return overlay_path(file_); }

  const fs::path folder_ = fs::path(testing::TempDir()) / "doppel_calibration", file_ = folder_ / "arm.urdf";
  Bus bus_;
  Node listener_;
  Calibration state_;
  double true_ = 0, speed_ = 0;
  std::optional<CalibrationService> service_;
  std::unique_ptr<Edge> edge_;
};

TEST_F(CalibrationServiceTest, TwoPosesGiveZeroDirectionAndOverlayOfVerb) {
  EXPECT_THAT(lift().poses, ElementsAre(0, testing::DoubleNear(M_PI / 2, 1e-9)));
  const MeasureJoint::Response first = measure(0);
  ASSERT_TRUE(first.success) << first.message;
  EXPECT_NEAR(first.machine, kZero, 1e-12);
  EXPECT_FALSE(lift().fitted);
  ASSERT_TRUE(measure(M_PI / 2).success);
  EXPECT_TRUE(lift().fitted);
  EXPECT_EQ(lift().direction, -1);
  EXPECT_NEAR(lift().zero, kZero, 1e-9);
  EXPECT_NEAR(lift().scale, 1, 1e-9);
  EXPECT_EQ(lift().corrections.size(), 2u);
  EXPECT_FALSE(fs::exists(overlay())) << "nothing is written unasked";
  const WriteCalibration::Response written = write();
  ASSERT_TRUE(written.success) << written.message;
  EXPECT_EQ(written.file, overlay().string());
  EXPECT_EQ(read_overlay(overlay()).operations.size(), 2u);
  EXPECT_TRUE(lift().written);
  EXPECT_THAT(state_.undo_joints, ElementsAre("lift"));
  EXPECT_NEAR(load().joints.front().axis.z(), -1, 1e-9);
}

TEST_F(CalibrationServiceTest, UndoLeavesFileAsBefore) {
  const std::string before = "# My corrections.\n- set_limit: lift\n  velocity: 4\n  was: {velocity: 5}\n";
  std::ofstream(overlay()) << before;
  ASSERT_TRUE(measure(0).success && measure(M_PI / 2).success);
  ASSERT_TRUE(write().success);
  const Trigger::Response undone = call<Trigger>("/doppel/calibrate/undo", {});
  ASSERT_TRUE(undone.success) << undone.message;
  std::ifstream in(overlay());
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), before);
  EXPECT_FALSE(lift().written);
  EXPECT_THAT(call<Trigger>("/doppel/calibrate/undo", {}).message, HasSubstr("nothing was written"));
}

TEST_F(CalibrationServiceTest, UndoRefusesFileThatHasChanged) {
  ASSERT_TRUE(measure(0).success && measure(M_PI / 2).success);
  ASSERT_TRUE(write().success);
  std::ofstream(overlay(), std::ios::app) << "# mine\n";
  EXPECT_THAT(call<Trigger>("/doppel/calibrate/undo", {}).message, HasSubstr("has changed since"));
  EXPECT_TRUE(fs::exists(overlay()));
}

TEST_F(CalibrationServiceTest, PosesThatAreTooCloseAreRefusedUnmeasured) {
  ASSERT_TRUE(measure(0).success);
  const MeasureJoint::Response refused = measure(0.5);
  EXPECT_FALSE(refused.success);
  EXPECT_THAT(refused.message, HasSubstr("60 deg"));
  EXPECT_EQ(lift().measurements.size(), 1u);
}

TEST_F(CalibrationServiceTest, JointThatMovesIsRefused) {
  speed_ = 0.01;
  const MeasureJoint::Response refused = measure(0);
  EXPECT_FALSE(refused.success);
  EXPECT_THAT(refused.message, HasSubstr("'lift' moves"));
  EXPECT_THAT(lift().measurements, IsEmpty());
  EXPECT_EQ(state_.measuring, "");
}

TEST_F(CalibrationServiceTest, UnknownJointGetsNearestName) {
  EXPECT_THAT(measure(0, "lfit").message, HasSubstr("did you mean 'lift'"));
}

TEST_F(CalibrationServiceTest, SamePoseReplacesItsMeasurementAndForgetDropsAll) {
  ASSERT_TRUE(measure(0).success);
  ASSERT_TRUE(measure(0).success);
  EXPECT_EQ(lift().measurements.size(), 1u);
  ForgetMeasurements::Request request;
  request.joint = "lift";
  ASSERT_TRUE(call<ForgetMeasurements>("/doppel/calibrate/forget", request).success);
  EXPECT_THAT(lift().measurements, IsEmpty());
  EXPECT_THAT(write().message, HasSubstr("no joint has a result"));
}

TEST_F(CalibrationServiceTest, JointThatHasChangedLosesItsMeasurements) {
  ASSERT_TRUE(measure(0).success);
  service_->update();
  bus_.spin();
  EXPECT_EQ(lift().measurements.size(), 1u) << "the joint is the same";
  std::string text = kArm;
  text.replace(text.find("0 0 1"), 5, "0 1 0");
  std::ofstream(file_) << text;
  service_->update();
  bus_.spin();
  EXPECT_THAT(lift().measurements, IsEmpty());
}

TEST_F(CalibrationServiceTest, FileThatHasChangedIsNotCorrected) {
  ASSERT_TRUE(measure(0).success && measure(M_PI / 2).success);
  std::string text = kArm;
  text.replace(text.find("0 0 1"), 5, "0 1 0");
  std::ofstream(file_) << text;
  EXPECT_THAT(write().message, HasSubstr("another joint in the file"));
  EXPECT_FALSE(fs::exists(overlay()));
}

}  // namespace
}  // namespace doppel
