// What surrounds a running twin, assembled as in `doppel up`: its addresses, its description, edits of its
// sources.
#include "doppel/session/live/session.h"

#include <gmock/gmock.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <thread>

#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class SessionTest : public TwinFixture {
 protected:
  void SetUp() override {
    folder_ = make_folder("session");
    fs::create_directories(folder_ / "urdf");
    write("1.0");
    bring_up((folder_ / "urdf/arm.urdf").string());
    options_.bundled = {DOPPEL_SOURCE_DIR "/robots", DOPPEL_SOURCE_DIR "/datasheets"};
  }
  void TearDown() override {
    edge_.reset();
    twin_.reset();
    fs::remove_all(folder_);
  }

  void write(const std::string& upper) {
    std::ofstream(folder_ / "urdf/arm.urdf")
        << "<robot name='arm'><link name='base'/><link name='upper'><inertial><mass value='0.1'/><inertia "
           "ixx='1e-4' "
           "ixy='0' ixz='0' iyy='1e-4' iyz='0' izz='1e-4'/></inertial></link><joint name='elbow' "
           "type='revolute'>"
           "<parent link='base'/><child link='upper'/><axis xyz='0 0 1'/><limit lower='-1' upper='"
        << upper << "' effort='1' velocity='1'/></joint></robot>";
  }
  // Runs the loop until the condition holds, 20 s of wall-clock time at most.
  template <class Condition>
  bool until(const Condition& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) return false;
      run(0.01);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }
  // A service that answers from another thread.
  template <class S>
  typename S::Response ask(const std::string& service, const typename S::Request& request) {
    const auto response = std::make_shared<std::optional<typename S::Response>>();
    edge_->call(service, to_cdr(request), [response](const Status& status, const Bytes& cdr) {
      EXPECT_TRUE(status) << status.why();
      EXPECT_TRUE(from_cdr(cdr, response->emplace()));
    });
    EXPECT_TRUE(until([&] { return response->has_value(); })) << service;
    return response->value_or(typename S::Response());
  }
  [[nodiscard]] double upper_limit() const { return twin_->robot().model().joints.front().upper; }

  fs::path folder_;
  SessionOptions options_;
};

TEST_F(SessionTest, BannerNamesServerAddress) {
  TwinSession session(*twin_, options_, log_);
  EXPECT_THAT(session.banner(), HasSubstr(session.server().server().url()));
  EXPECT_THAT(session.banner(), Not(HasSubstr("ros 2"))) << "expected no network: none was requested";
  session.begin();
  EXPECT_FALSE(session.ros().is_open());
}

TEST_F(SessionTest, HealthIsPublishedAfterStart) {
  TwinSession session(*twin_, options_, log_);
  listen("/doppel/health");
  run(0.05);
  EXPECT_THAT(received<std_msgs::msg::String>("/doppel/health"), IsEmpty());
  session.begin();
  listen("/doppel/health");
  std::string health;
  EXPECT_TRUE(until([&] {
    for (const auto& message : received<std_msgs::msg::String>("/doppel/health")) health = message.data;
    return !health.empty();
  }));
  EXPECT_THAT(health, HasSubstr("\"findings\""));
}

TEST_F(SessionTest, EditIsAppliedWhereReloadIsEnabled) {
  TwinSession session(*twin_, options_, log_);
  session.begin();
  run(0.05);
  write("0.5");
  EXPECT_TRUE(until([this] { return upper_limit() == 0.5; }));
}

TEST_F(SessionTest, EditIsIgnoredWhereReloadIsDisabled) {
  options_.reload = false;
  TwinSession session(*twin_, options_, log_);
  session.begin();
  write("0.5");
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  run(0.2);
  EXPECT_EQ(upper_limit(), 1.0);
}

// A suite that keeps what it is asked to judge.
class KeptRequest : public ValidationWork {
 public:
  [[nodiscard]] doppel_msgs::srv::ListChecks::Response checks() const override { return {}; }
  void check_words(const doppel_msgs::srv::Validate::Request&) const override {}
  [[nodiscard]] std::string results() const override { return ""; }
  [[nodiscard]] std::string report(const std::string&, const std::string& page) const override {
    return page;
  }
  std::string run(const ValidationRequest& request, const ValidationWatcher&) override {
    last = request;
    return "done";
  }
  ValidationRequest last;
};

TEST_F(SessionTest, ValidationJudgesRobotAloneWithDrives) {
  const auto work = std::make_shared<KeptRequest>();
  options_.validation = [work] { return work; };
  options_.scenario.robots = {{.target = "another"}};
  options_.scenario.world = "table";
  options_.scenario.ideal = true;
  options_.scenario.engine = "bullet";
  TwinSession session(*twin_, options_, log_);
  session.begin();
  doppel_msgs::srv::Validate::Request request;
  request.robot = "lef";
  EXPECT_THAT(std::string(ask<doppel_msgs::srv::Validate>("/doppel/validate", request).message),
              HasSubstr("there is no robot 'lef'"));
  listen("/doppel/validation");
  request.robot = "";
  EXPECT_TRUE(ask<doppel_msgs::srv::Validate>("/doppel/validate", request).success);
  using State = doppel_msgs::msg::Validation;
  EXPECT_TRUE(until([&] {
    const auto states = received<State>("/doppel/validation");
    return std::ranges::any_of(states, [](const State& one) { return one.state == State::FINISHED; });
  }));
  const Scenario& judged = work->last.scenario;
  ASSERT_EQ(judged.robots.size(), 1U);
  EXPECT_EQ(judged.robots.front().target, (folder_ / "urdf/arm.urdf").string());
  EXPECT_FALSE(judged.world.has_value());
  EXPECT_FALSE(judged.ideal);
  EXPECT_EQ(judged.engine, "bullet");
  const std::string report = ask<doppel_msgs::srv::GetValidationReport>("/doppel/validate/report", {}).text;
  EXPECT_EQ(report, "http://127.0.0.1:" + std::to_string(session.server().server().port()) + "/");
}

TEST_F(SessionTest, RobotsSpawnedAfterSessionEndDoNotReachIt) {
  { const TwinSession session(*twin_, options_, log_); }
  const std::string answer =
      call("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
           "{name: box, xml: \"<sdf version='1.7'><model name='box'><link name='l'><collision "
           "name='c'><geometry><box>"
           "<size>0.1 0.1 0.1</size></box></geometry></collision></link></model></sdf>\"}");
  run(0.01);
  EXPECT_NE(twin_->engine().world().find("box"), -1) << answer;
}

TEST(RosNetworkTest, CommandLineOverridesEnvironment) {
  setenv("ROS_DOMAIN_ID", "7", 1);
  Diagnostics diagnostics;
  RosArguments ros;
  EXPECT_EQ(ros_network({}, ros, diagnostics)->domain, 7U);
  ros.enclave = "/arm";
  const auto network = ros_network({.none = false, .domain = 9}, ros, diagnostics);
  unsetenv("ROS_DOMAIN_ID");
  ASSERT_TRUE(network.has_value());
  EXPECT_EQ(network->domain, 9U);
  EXPECT_EQ(network->enclave, "/arm");
  EXPECT_FALSE(ros_network({.none = true, .domain = {}}, ros, diagnostics).has_value());
}

TEST_F(SessionTest, ViewHasServer) {
  Scenario scenario;
  scenario.robots = {{.target = (folder_ / "urdf/arm.urdf").string()}};
  Diagnostics diagnostics;
  Viewer viewer(scenario, log_, diagnostics);
  ViewSession session(viewer, scenario.robots.front(), options_, log_);
  session.begin();
  EXPECT_THAT(session.banner(), HasSubstr(session.server().server().url()));
  EXPECT_THAT(session.page_line(), HasSubstr(session.server().server().page_url()));
}

}  // namespace
}  // namespace doppel::test
