#include "doppel/twin/viewer/viewer.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <set>

#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using sensor_msgs::msg::JointState;

constexpr double kPi = std::numbers::pi;

std::string joint_with(const std::string& name, const std::string& type, const std::string& parent,
                       const std::string& child, const std::string& inside) {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/><axis xyz=\"0 0 1\"/>" + inside + "</joint>\n";
}

// base - lift (0.1..0.5) - elbow (-1..1) - finger follows the elbow, -2 times; base - wheel turns forever.
std::string arm(
    const std::string& elbow_limit = "<limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/>",
    const std::string& more = "") {
  std::string out = "<robot name=\"arm\">\n";
  for (const char* link : {"base", "carriage", "arm", "tip", "rim"})
    out += std::string("<link name=\"") + link + "\"/>\n";
  out += joint_with("lift", "prismatic", "base", "carriage",
                    "<limit lower=\"0.1\" upper=\"0.5\" effort=\"1\" velocity=\"1\"/>");
  out += joint_with("elbow", "revolute", "carriage", "arm", elbow_limit);
  out += joint_with("finger", "revolute", "arm", "tip",
                    "<limit lower=\"-3\" upper=\"3\" effort=\"1\" velocity=\"1\"/>"
                    "<mimic joint=\"elbow\" multiplier=\"-2\" offset=\"0.25\"/>");
  out += joint_with("wheel", "continuous", "base", "rim", "");
  return out + more + "</robot>\n";
}

class ViewerTest : public ::testing::Test {
 protected:
  ViewerTest() : folder_(fs::temp_directory_path() / ("doppel_viewer_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
    log_.add_sink([this](const LogLine& line) { said_.push_back(line.text); });
  }
  ~ViewerTest() override {
    edge_.reset();
    viewer_.reset();
    fs::remove_all(folder_);
  }

  void write(const std::string& text) { std::ofstream(folder_ / "arm.urdf") << text; }
  void view(const std::string& text) {
    write(text);
    Scenario scenario;
    scenario.robots = {{.target = (folder_ / "arm.urdf").string()}};
    edge_.reset();
    viewer_ = std::make_unique<Viewer>(scenario, log_, diagnostics_);
    edge_ = viewer_->bus().attach("test");
  }
  void reload(const std::string& text) {
    write(text);
    viewer_->replace(Viewer::prepare(*viewer_->scenario(), diagnostics_));
  }

  void frame() { viewer_->step(now_ += Duration(16'666'667)); }
  void command(const std::vector<std::string>& names, const std::vector<double>& positions,
               const std::vector<double>& velocities = {}) {
    JointState message;
    message.name = names;
    message.position = positions;
    message.velocity = velocities;
    const Status sent =
        edge_->publish("/test", "/joint_command", "sensor_msgs/msg/JointState", to_cdr(message));
    ASSERT_TRUE(sent.ok()) << sent.why();
    frame();
  }
  [[nodiscard]] double at(const std::string& name) const {
    const int index = viewer_->model().find_joint(name);
    if (index < 0) return std::nan("");
    return viewer_->q()[viewer_->model().joints[static_cast<std::size_t>(index)].q];
  }

  void listen(const std::string& topic) {
    for (const TopicInfo& info : viewer_->bus().topics()) {
      if (info.name == topic) edge_->subscribe(info.id);
    }
    frame();
  }
  template <class M>
  std::vector<M> received() {
    std::vector<M> out;
    for (Edge::Incoming incoming; edge_->next(incoming);) {
      M message;
      EXPECT_TRUE(from_cdr(incoming.cdr, message).ok());
      out.push_back(std::move(message));
    }
    return out;
  }
  [[nodiscard]] bool has(const std::string& rule) const {
    const auto& all = diagnostics_.all();
    return std::any_of(all.begin(), all.end(), [&](const Diagnostic& d) { return d.rule == rule; });
  }

  fs::path folder_;
  Log log_;
  std::vector<std::string> said_;
  Diagnostics diagnostics_;
  std::unique_ptr<Viewer> viewer_;
  std::unique_ptr<Edge> edge_;
  Time now_{std::chrono::seconds(1'700'000'000)};
};

TEST_F(ViewerTest, StartIsWithinLimits) {
  view(arm());
  EXPECT_DOUBLE_EQ(at("lift"), 0.1);
  EXPECT_DOUBLE_EQ(at("elbow"), 0.0);
  EXPECT_DOUBLE_EQ(at("finger"), 0.25);
}

TEST_F(ViewerTest, StartIsAtInitialValues) {
  view(
      arm("<limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/>",
          "<ros2_control name=\"s\" type=\"system\"><hardware><plugin>x/Y</plugin></hardware>"
          "<joint name=\"elbow\"><state_interface name=\"position\"><param name=\"initial_value\">0.5</param>"
          "</state_interface></joint></ros2_control>"));
  EXPECT_DOUBLE_EQ(at("elbow"), 0.5);
  EXPECT_DOUBLE_EQ(at("finger"), -0.75);
}

TEST_F(ViewerTest, CommandsAreClampedToLimits) {
  view(arm());
  command({"elbow", "lift"}, {7.0, -2.0}, {9.0, 9.0});
  EXPECT_DOUBLE_EQ(at("elbow"), 1.0);
  EXPECT_DOUBLE_EQ(at("lift"), 0.1);
  command({"elbow", "lift"}, {-0.5, 0.3});
  EXPECT_DOUBLE_EQ(at("elbow"), -0.5);
  EXPECT_DOUBLE_EQ(at("lift"), 0.3);
  ASSERT_EQ(said_.size(), 2U);  // once for each joint
  EXPECT_NE(said_[0].find("the position 7 of 'elbow' is outside its limits"), std::string::npos) << said_[0];
  EXPECT_NE(said_[1].find("the position -2 of 'lift' is outside its limits"), std::string::npos) << said_[1];
}

TEST_F(ViewerTest, ContinuousJointsStayWithinTurn) {
  view(arm());
  command({"wheel"}, {5 * kPi / 2});
  EXPECT_NEAR(at("wheel"), kPi / 2, 1e-12);
  command({"wheel"}, {-1.0});
  EXPECT_DOUBLE_EQ(at("wheel"), -1.0);
}

TEST_F(ViewerTest, MimicsFollowAndAreNotSet) {
  view(arm());
  command({"elbow", "finger"}, {0.5, 2.0});
  EXPECT_DOUBLE_EQ(at("finger"), -0.75);
  command({"finger"}, {2.0});
  EXPECT_DOUBLE_EQ(at("finger"), -0.75);
  ASSERT_EQ(said_.size(), 1U);
  EXPECT_NE(said_[0].find("mimics 'elbow'"), std::string::npos) << said_[0];
}

TEST_F(ViewerTest, NanMovesNothing) {
  view(arm());
  command({"elbow", "lift"}, {0.5, 0.2});
  for (const double odd : {std::nan(""), std::numeric_limits<double>::infinity()})
    command({"elbow", "lift"}, {odd, 0.4});
  EXPECT_DOUBLE_EQ(at("elbow"), 0.5);
  EXPECT_DOUBLE_EQ(at("lift"), 0.4);
  EXPECT_EQ(said_.size(), 1U);
  command({"elbow", "lift"}, {0.1});
  EXPECT_DOUBLE_EQ(at("elbow"), 0.5);
  ASSERT_EQ(said_.size(), 2U);
  EXPECT_NE(said_[1].find("2 names with 1 positions"), std::string::npos) << said_[1];
}

TEST_F(ViewerTest, UnknownNameIsReportedOnceWithNearest) {
  view(arm());
  for (int i = 0; i < 5; ++i) command({"elbwo", "lift"}, {0.5, 0.2});
  EXPECT_DOUBLE_EQ(at("lift"), 0.2);
  ASSERT_EQ(said_.size(), 1U);
  EXPECT_NE(said_[0].find("did you mean 'elbow'?"), std::string::npos) << said_[0];
  for (int i = 0; i < 500; ++i) command({"made up " + std::to_string(i)}, {0.5});
  EXPECT_LE(said_.size(), 60U) << "expected a bounded number of log lines";
}

TEST_F(ViewerTest, PublishesOnChangeAndAtTenHz) {
  view(arm());
  frame();
  listen("/joint_states");
  received<JointState>();
  for (int i = 0; i < 60; ++i) frame();
  const auto resting = received<JointState>();
  EXPECT_GE(resting.size(), 9U);
  EXPECT_LE(resting.size(), 11U);
  command({"elbow"}, {0.5});
  const auto moved = received<JointState>();
  ASSERT_EQ(moved.size(), 1U);
  EXPECT_EQ(moved[0].name, (std::vector<std::string>{"lift", "elbow", "finger", "wheel"}));
  EXPECT_EQ(moved[0].position, (std::vector<double>{0.1, 0.5, -0.75, 0.0}));
  EXPECT_EQ(moved[0].header.stamp.sec, nanoseconds_of(now_) / 1'000'000'000);
}

TEST_F(ViewerTest, ClockSetBackKeepsPublishing) {
  view(arm());
  frame();
  listen("/joint_states");
  received<JointState>();
  now_ -= std::chrono::hours(1);
  frame();
  EXPECT_EQ(received<JointState>().size(), 1U);
}

TEST_F(ViewerTest, PublishesDescriptionAndTransformsWithoutClock) {
  view(arm());
  std::set<std::string> topics;
  for (const TopicInfo& info : viewer_->bus().topics()) topics.insert(info.name);
  for (const char* wanted : {"/joint_states", "/tf", "/tf_static", "/robot_description", "/joint_command"})
    EXPECT_TRUE(topics.contains(wanted)) << wanted;
  EXPECT_FALSE(topics.contains("/clock"));
  frame();
  listen("/robot_description");
  const auto described = received<std_msgs::msg::String>();
  ASSERT_EQ(described.size(), 1U);
  EXPECT_NE(described[0].data.find("<robot name=\"arm\""), std::string::npos);
}

TEST_F(ViewerTest, ReloadKeepsJointsWithinNewLimits) {
  view(arm());
  command({"elbow", "lift", "wheel"}, {0.9, 0.3, 1.0});
  reload(arm(
      "<limit lower=\"-0.4\" upper=\"0.4\" effort=\"1\" velocity=\"1\"/>",
      "<link name=\"lamp\"/>" + joint_with("neck", "revolute", "base", "lamp",
                                           "<limit lower=\"1\" upper=\"2\" effort=\"1\" velocity=\"1\"/>")));
  frame();
  EXPECT_DOUBLE_EQ(at("elbow"), 0.4);
  EXPECT_DOUBLE_EQ(at("finger"), -0.55);
  EXPECT_DOUBLE_EQ(at("lift"), 0.3);
  EXPECT_DOUBLE_EQ(at("wheel"), 1.0);
  EXPECT_DOUBLE_EQ(at("neck"), 1.0);
  command({"neck"}, {1.5});
  EXPECT_DOUBLE_EQ(at("neck"), 1.5);
}

TEST_F(ViewerTest, UnreadableEditKeepsRobot) {
  view(arm());
  command({"elbow"}, {0.5});
  write("<robot name=\"arm\"><link");
  EXPECT_THROW((void)Viewer::prepare(*viewer_->scenario(), diagnostics_), InputError);
  frame();
  EXPECT_DOUBLE_EQ(at("elbow"), 0.5);
}

TEST_F(ViewerTest, DrawablePartsAreShown) {
  const std::string more =
      "<link name=\"a\"><inertial><mass value=\"1\"/></inertial><visual><geometry><blob/></geometry></visual>"
      "</link><link name=\"b\"/><link name=\"c\"/><link name=\"d\"/><link name=\"e\"/><link name=\"f\"/>"
      "<joint name=\"still\" type=\"revolute\"><parent link=\"base\"/><child link=\"a\"/><axis xyz=\"0 0 "
      "0\"/>"
      "<limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>" +
      joint_with("crossed", "revolute", "base", "b", "<limit lower=\"2\" upper=\"-1\"/>") +
      joint_with("alone", "continuous", "base", "c", "<mimic joint=\"nobody\"/>") +
      joint_with("round", "continuous", "base", "d", "<mimic joint=\"round\"/>") +
      joint_with("after", "continuous", "base", "e", "<mimic joint=\"still\"/>") +
      joint_with("loose", "floating", "base", "f", "");
  view(arm("<limit lower=\"-1\" upper=\"1\"/>", more));
  for (const char* rule : {"urdf.axis_zero", "urdf.limits_crossed", "urdf.mimic_unknown", "urdf.mimic_loop",
                           "urdf.mimic_not_scalar", "urdf.inertial", "urdf.geometry"})
    EXPECT_TRUE(has(rule)) << rule;
  EXPECT_FALSE(diagnostics_.has_errors());
  command({"crossed", "alone", "round", "after", "still"}, {1.5, 0.5, 0.25, 0.125, 1.0});
  EXPECT_DOUBLE_EQ(at("crossed"), 1.5);
  EXPECT_DOUBLE_EQ(at("alone"), 0.5);
  EXPECT_DOUBLE_EQ(at("round"), 0.25);
  EXPECT_DOUBLE_EQ(at("after"), 0.125);
  const int still = viewer_->model().find_joint("still");
  EXPECT_EQ(viewer_->model().joints[static_cast<std::size_t>(still)].nq, 0);
}

TEST_F(ViewerTest, InvalidDescriptionIsRefused) {
  EXPECT_THROW(view("<robot name=\"x\"><link name=\"a\"/><link name=\"b\"/></robot>"), InputError);
  EXPECT_THROW(view("<robot name=\"x\"><link name=\"a\"/>"), InputError);
  EXPECT_THROW(view("<sdf/>"), InputError);
  EXPECT_THROW(view(arm("<limit lower=\"much\" upper=\"1\"/>")), InputError);
}

}  // namespace
}  // namespace doppel
