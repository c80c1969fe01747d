// Several robots in one world: each in its namespace, in one engine on one clock; robots that come and go
// while the others run.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <thread>

#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "doppel/scenario/schema/robot_text.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class SeveralRobotsTest : public TwinFixture {
 protected:
  void bring_up_robots(const std::vector<std::string>& texts) {
    Scenario scenario;
    for (const std::string& text : texts) scenario.robots.push_back(parse_robot(text));
    bring_up(scenario);
  }
  [[nodiscard]] TwinRobot& robot(const std::string& name_space) const {
    TwinRobot* const found = twin_->find_robot(name_space);
    if (found == nullptr) throw std::runtime_error("expected a robot " + name_space);
    return *found;
  }
  [[nodiscard]] double q(const std::string& name_space, const std::string& joint) const {
    const TwinRobot& of = robot(name_space);
    return of.instance().q()[static_cast<std::size_t>(
        of.model().joints[static_cast<std::size_t>(of.model().find_joint(joint))].q)];
  }
  [[nodiscard]] std::vector<std::string> topics() const {
    std::vector<std::string> out;
    for (const TopicInfo& topic : twin_->bus().topics()) out.push_back(topic.name);
    return out;
  }
  // All six joints of an omarm_one.
  void go_to(const std::string& name_space, const std::string& positions, double seconds) {
    publish("/" + name_space + "/omarm_arm_controller/joint_trajectory",
            "trajectory_msgs/msg/JointTrajectory",
            R"({joint_names: ["Revolute 1","Revolute 2","Revolute 3","Revolute 4","Revolute 5","Revolute 6"],
points: [{positions: [)" +
                positions +
                "], time_from_start: {nanosec: " + std::to_string(static_cast<int>(seconds * 1e9)) + "}}]}");
  }
  [[nodiscard]] std::string described(const std::string& target) const {
    Scenario scenario;
    scenario.robots = {{.target = target}};
    scenario.bundled_robots = DOPPEL_SOURCE_DIR "/robots";
    Diagnostics said;
    return Twin(scenario, log_, said).robot().description().xml;
  }
  // Runs the loop until the response arrives: a robot is prepared on a separate thread.
  std::string call_and_run(const std::string& service, const std::string& type, const std::string& yaml) {
    const ServiceSupport* support = find_service(type);
    Bytes request;
    EXPECT_TRUE(support->request->yaml_to_cdr(yaml, request).ok());
    std::string out;
    edge_->call(service, request, [&](Status status, Bytes response) {
      if (!status) {
        out = status.why();
      } else {
        static_cast<void>(support->response->cdr_to_yaml(response, out));
      }
    });
    for (int i = 0; i < 3000 && out.empty(); ++i) {
      run(0.001);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return out;
  }
};

TEST_F(SeveralRobotsTest, NodesTopicsAndControllersAreNamespaced) {
  bring_up_robots({"omarm_one:left", "omarm_one:right@0.8,0,0,0,0,3.14159"});
  run(0.1);
  ASSERT_EQ(twin_->robots().size(), 2u);
  EXPECT_EQ(twin_->name(), "left, right");
  const std::vector<std::string> nodes = twin_->bus().nodes();
  for (const char* ns : {"/left", "/right"}) {
    for (const char* node : {"/controller_manager", "/robot_state_publisher", "/omarm_arm_controller"})
      EXPECT_THAT(nodes, Contains(std::string(ns) + node));
    for (const char* topic : {"/robot_description", "/joint_states", "/tf", "/tf_static",
                              "/doppel/joint_loads", "/omarm_arm_controller/joint_trajectory"})
      EXPECT_THAT(topics(), Contains(std::string(ns) + topic));
  }
  EXPECT_THAT(nodes, Not(Contains("/controller_manager")));
  EXPECT_THAT(topics(), Not(Contains("/joint_states")));
  EXPECT_EQ(std::ranges::count(topics(), "/clock"), 1);
  EXPECT_EQ(robot("left").controller_manager().controllers().size(),
            robot("right").controller_manager().controllers().size());
}

TEST_F(SeveralRobotsTest, TransformsArePrefixedInCommonTree) {
  bring_up_robots({"omarm_one:left", "omarm_one:right@0.8,0,0"});
  for (const char* topic : {"/tf_static", "/left/tf", "/tf"}) listen(topic);
  run(0.1);
  std::vector<std::string> parents, children;
  double x = 0;
  Edge::Incoming incoming;
  std::map<TopicId, std::string> names;
  for (const TopicInfo& topic : twin_->bus().topics()) names[topic.id] = topic.name;
  std::set<std::string> shared, own, fixed;
  while (edge_->next(incoming)) {
    tf2_msgs::msg::TFMessage message;
    ASSERT_TRUE(from_cdr(incoming.cdr, message).ok());
    for (const auto& transform : message.transforms) {
      const std::string& topic = names[incoming.topic];
      (topic == "/tf" ? shared : topic == "/left/tf" ? own : fixed).insert(transform.child_frame_id);
      if (transform.child_frame_id.starts_with("right/") && transform.header.frame_id == "world")
        x = transform.transform.translation.x;
    }
  }
  EXPECT_NEAR(x, 0.8, 1e-9) << "expected one tree with the root world";
  const auto starts = [](const std::set<std::string>& frames, const char* prefix) {
    return std::ranges::count_if(frames, [&](const std::string& f) { return f.starts_with(prefix); });
  };
  EXPECT_GT(starts(shared, "left/"), 0);
  EXPECT_EQ(starts(shared, "left/"), starts(shared, "right/"));
  EXPECT_EQ(starts(fixed, "left/"), starts(fixed, "right/"))
      << "expected the latched message to contain the frames of all robots";
  EXPECT_GT(own.size(), 0u);
  EXPECT_EQ(starts(own, "left/"), 0);
}

TEST_F(SeveralRobotsTest, RobotsFollowOwnTrajectories) {
  bring_up_robots({"omarm_one:left", "omarm_one:right@0.8,0,0,0,0,3.14159"});
  run(0.1);
  go_to("left", "1.0, 1.57, 1.57, 1.57, 1.57, 1.57", 0.5);
  go_to("right", "2.0, 1.57, 1.57, 1.57, 1.57, 1.57", 0.5);
  run(1.0);
  EXPECT_NEAR(q("left", "Revolute 1"), 1.0, 0.02);
  EXPECT_NEAR(q("right", "Revolute 1"), 2.0, 0.02);
}

// Two robots that reach for the same place from opposite sides touch there.
TEST_F(SeveralRobotsTest, ContactBetweenRobotsNamesBoth) {
  const std::string reach = "1.0, 1.2, 1.57, 1.57, 1.57, 1.57";
  bring_up_robots({"omarm_one:left"});
  run(0.1);
  go_to("left", reach, 0.5);
  run(1.0);
  const Instance& alone = robot("left").instance();
  const Eigen::Vector3d hand = alone.link_pose(alone.model().find_link("gripper_base_1")).translation();
  Scenario scenario;
  scenario.robots = {parse_robot("omarm_one:left"), parse_robot("omarm_one:right")};
  scenario.robots[1].X_WR = make_pose({1.9 * hand.x(), 1.9 * hand.y(), 0}, {0, 0, 3.14159265358979});
  bring_up(scenario);
  listen("/gazebo/contacts");
  run(0.1);
  go_to("left", reach, 1.0);
  go_to("right", reach, 1.0);
  run(1.5);
  bool met = false;
  for (const auto& message : received<gazebo_msgs::msg::ContactsState>("/gazebo/contacts")) {
    for (const auto& state : message.states) {
      const std::string both = state.collision1_name + " " + state.collision2_name;
      met = met || (both.find("left::") != std::string::npos && both.find("right::") != std::string::npos);
    }
  }
  EXPECT_TRUE(met);
}

// MuJoCo's constraint solver (friction, couplings, contacts) stops when the constraints of the whole world
// are solved well enough, so that another robot changes the last digits.
TEST_F(SeveralRobotsTest, DistantRobotMovesAsAlone) {
  const auto positions_of_left = [&](const std::vector<std::string>& robots) {
    bring_up_robots(robots);
    run(0.1);
    go_to("left", "1.0, 1.2, 1.57, 1.57, 1.57, 1.57", 0.5);
    run(0.7);
    const auto now = robot("left").instance().q();
    return std::vector<double>(now.begin(), now.end());
  };
  const auto alone = positions_of_left({"omarm_one:left"});
  const auto beside = positions_of_left({"omarm_one:left", "omarm_one:right@5,0,0"});
  ASSERT_EQ(alone.size(), beside.size());
  double worst = 0;
  for (std::size_t i = 0; i < alone.size(); ++i) worst = std::max(worst, std::abs(alone[i] - beside[i]));
  EXPECT_LT(worst, 1e-7);
  RecordProperty("worst", std::to_string(worst));
}

TEST_F(SeveralRobotsTest, DuplicateNamespaceIsRefusedAndMissingOneIsGiven) {
  EXPECT_THROW(bring_up_robots({"omarm_one:left", "omarm_one:left@1,0,0"}), InputError);
  bring_up_robots({"omarm_one", "omarm_one@1,0,0"});
  EXPECT_NE(twin_->find_robot(""), nullptr);
  EXPECT_NE(twin_->find_robot("omarm_one_2"), nullptr);
  EXPECT_TRUE(std::ranges::any_of(diagnostics_.all(),
                                  [](const Diagnostic& d) { return d.rule == "up.namespace_given"; }));
}

TEST_F(SeveralRobotsTest, RemappingToOneNamespaceIsRefused) {
  Scenario scenario;
  scenario.robots = {parse_robot("omarm_one:left"), parse_robot("omarm_one:right@1,0,0")};
  scenario.ros.names.add("__ns:=/both");
  EXPECT_THROW(bring_up(scenario), InputError);
}

TEST_F(SeveralRobotsTest, JointsAndLinksCarryRobotName) {
  bring_up_robots({"omarm_one:left", "omarm_one:right@0.8,0,0"});
  run(0.1);
  EXPECT_THAT(call("/gazebo/get_state", "doppel_msgs/srv/GetState", "{}"), HasSubstr("left::Revolute 1"));
  EXPECT_THAT(call("/gazebo/set_state", "doppel_msgs/srv/SetState",
                   "{names: ['Revolute 1'], positions: [1.0], velocities: []}"),
              HasSubstr("exists in several robots; write for example ''left::Revolute 1''"));
  EXPECT_THAT(call("/gazebo/set_state", "doppel_msgs/srv/SetState",
                   "{names: ['right::Revolute 1'], positions: [1.0], velocities: []}"),
              HasSubstr("success: true"));
  EXPECT_NEAR(q("right", "Revolute 1"), 1.0, 1e-9);
  EXPECT_THAT(call("/gazebo/get_entity_state", "gazebo_msgs/srv/GetEntityState", "{name: 'right'}"),
              HasSubstr("x: 0.8"));
  EXPECT_THAT(call("/gazebo/get_entity_state", "gazebo_msgs/srv/GetEntityState", "{name: 'lefd'}"),
              HasSubstr("success: false"));
}

class RobotSpawnTest : public SeveralRobotsTest {
 protected:
  std::string spawn(const std::string& name, const std::string& at) {
    std::string xml = described("omarm_one"), quoted;
    for (const char c : xml) quoted += c == '\'' ? "''" : std::string(1, c);
    return call_and_run("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
                        "{name: '" + name + "', robot_namespace: '" + name +
                            "', initial_pose: {position: " + at + "}, xml: '" + quoted + "'}");
  }
};

TEST_F(RobotSpawnTest, SpawnedRobotRunsControllersUntilDeleted) {
  std::string logged;
  log_.add_sink([&logged](const LogLine& line) { logged += line.text + "\n"; });
  bring_up_robots({"omarm_one:left"});
  run(0.1);
  const std::string said = spawn("guest", "{x: 1.0}");
  ASSERT_THAT(said, HasSubstr("success: true"));
  EXPECT_THAT(said, HasSubstr("not reloaded from files"));
  EXPECT_THAT(logged, HasSubstr("the robot 'guest' is in the world; it was sent as XML"));
  run(0.2);
  ASSERT_NE(twin_->find_robot("guest"), nullptr);
  EXPECT_THAT(topics(), Contains("/guest/joint_states"));
  EXPECT_GT(robot("guest").controller_manager().controllers().size(), 1u);
  EXPECT_NEAR(robot("guest").instance().base_pose().translation().x(), 1.0, 1e-6);
  go_to("guest", "1.0, 1.57, 1.57, 1.57, 1.57, 1.57", 0.5);
  run(1.0);
  EXPECT_NEAR(q("guest", "Revolute 1"), 1.0, 0.02);
  EXPECT_THAT(spawn("guest", "{x: 2.0}"), HasSubstr("success: false"));
  EXPECT_THAT(call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: guest}"),
              HasSubstr("success: true"));
  run(0.1);
  EXPECT_EQ(twin_->find_robot("guest"), nullptr);
  EXPECT_EQ(twin_->engine().world().find("guest"), -1);
  for (const TopicInfo& topic : twin_->bus().topics()) {  // the test's own edge still publishes one of them
    EXPECT_TRUE(!topic.name.starts_with("/guest/") || topic.subscribers.empty()) << topic.name;
  }
  for (const std::string& node : twin_->bus().nodes()) EXPECT_FALSE(node.starts_with("/guest/")) << node;
  EXPECT_THAT(call("/delete_entity", "gazebo_msgs/srv/DeleteEntity", "{name: left}"),
              HasSubstr("success: true"))
      << "also the last one, because a world without robots can be started, too";
  run(0.1);
  EXPECT_TRUE(twin_->robots().empty());
}

TEST_F(RobotSpawnTest, SpawnAndDeleteKeepOthersBitIdentical) {
  bring_up_robots({"omarm_one:left"});
  run(0.1);
  go_to("left", "1.0, 1.2, 1.57, 1.57, 1.57, 1.57", 0.5);
  run(0.2);
  const auto state = [this] {
    const Instance& left = robot("left").instance();
    std::vector<double> out(left.q().begin(), left.q().end());
    out.insert(out.end(), left.v().begin(), left.v().end());
    for (const std::string& joint : left.model().driven_joint_names()) {
      out.push_back(left.drive_target(left.model().find_joint(joint)));
      out.push_back(left.drive_reference(left.model().find_joint(joint)));
    }
    return out;
  };
  const std::vector<double> before = state();
  const Time time = twin_->now();
  WorldRobot asked;
  asked.name_space = "guest";
  asked.X_WR = make_pose({5, 0, 0}, {0, 0, 0});
  Diagnostics said;
  twin_->add_robot(Twin::prepare_robot(twin_->running(), asked, described("omarm_one"), said));
  EXPECT_EQ(state(), before);
  EXPECT_TRUE(twin_->remove_robot("guest").ok());
  EXPECT_EQ(state(), before);
  EXPECT_EQ(twin_->now(), time);
  run(0.5);
  EXPECT_NEAR(q("left", "Revolute 1"), 1.0, 0.02) << "expected the trajectory to continue";
}

TEST_F(RobotSpawnTest, FailedSpawnChangesNothing) {
  bring_up_robots({"omarm_one:left"});
  run(0.1);
  const std::size_t nodes = twin_->bus().nodes().size();
  const std::string two_roots =
      "<robot name=''r''><link name=''a''/><link name=''b''/><ros2_control name=''x'' "
      "type=''system''/></robot>";
  EXPECT_THAT(call_and_run("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
                           "{name: broken, xml: '" + two_roots + "'}"),
              HasSubstr("success: false"));
  EXPECT_THAT(call_and_run("/spawn_entity", "gazebo_msgs/srv/SpawnEntity",
                           "{name: 'not a name', xml: '" + two_roots + "'}"),
              HasSubstr("is not a valid namespace of a robot"));
  EXPECT_EQ(twin_->robots().size(), 1u);
  EXPECT_EQ(twin_->bus().nodes().size(), nodes);
}

TEST_F(RobotSpawnTest, ReloadKeepsSpawnedAndOmitsDeletedRobots) {
  bring_up_robots({"omarm_one:left", "omarm_one:right@1,0,0"});
  run(0.1);
  ASSERT_THAT(spawn("guest", "{x: 2.0}"), HasSubstr("success: true"));
  ASSERT_TRUE(twin_->remove_robot("right").ok());
  go_to("left", "1.0, 1.57, 1.57, 1.57, 1.57, 1.57", 0.3);
  run(0.5);
  const double before = q("left", "Revolute 1");
  Diagnostics said;
  EXPECT_EQ(twin_->replace(Twin::prepare(twin_->running(), said)), Twin::Reload::controllers_kept);
  EXPECT_EQ(twin_->name(), "left, guest");
  EXPECT_NEAR(q("left", "Revolute 1"), before, 1e-12);
  run(0.3);
  EXPECT_NEAR(q("left", "Revolute 1"), 1.0, 0.02);
  const auto stale = Twin::prepare(twin_->running(), said);
  ASSERT_TRUE(twin_->remove_robot("guest").ok());
  EXPECT_THROW(static_cast<void>(twin_->replace(stale)), InputError);
}

class WorldRobotsTest : public SeveralRobotsTest {
 protected:
  void TearDown() override { std::filesystem::remove(file_); }
  void write(const std::string& yaml) { std::ofstream(file_) << yaml; }
  void up() {
    Scenario scenario;
    scenario.world = file_;
    bring_up(scenario);
  }
  std::string error_of() {
    try {
      up();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  const std::filesystem::path file_ =
      std::filesystem::path(::testing::TempDir()) /
      (std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + "_robots.yaml");
};

TEST_F(WorldRobotsTest, RobotsOfFileAreStarted) {
  write(
      "robots:\n"
      "  - {robot: omarm_one, namespace: left, tf: separate}\n"
      "  - {robot: lab_arm, namespace: /right, xyz: [1, 0, 0], rpy: [0, 0, 1.57], base: fixed}\n");
  up();
  run(0.1);
  EXPECT_EQ(robot("left").model().name, robot("left").description().name);
  EXPECT_NEAR(robot("right").instance().root_pose().translation().x(), 1.0, 1e-12);
  EXPECT_THAT(topics(), Contains("/left/tf"));
}

TEST_F(WorldRobotsTest, InvalidRobotIsRefusedWithPlace) {
  write(
      "robots:\n  - {robot: omarm_one, namespaec: left}\n  - {namespace: right}\n  - {robot: x, tf: boht}\n");
  const std::string said = error_of();
  EXPECT_THAT(said, HasSubstr(":2:"));
  EXPECT_THAT(said, HasSubstr("did you mean 'namespace'?"));
  EXPECT_THAT(said, HasSubstr(":3:"));
  EXPECT_THAT(said, HasSubstr("needs the key 'robot'"));
  EXPECT_THAT(said, HasSubstr("did you mean 'both'?"));
  write("robots:\n  - {robot: omarm_one, namespace: a}\n  - {robot: omarm_one, namespace: a}\n");
  EXPECT_THAT(error_of(), HasSubstr(":3:"));
}

TEST_F(WorldRobotsTest, EmptyListOfRobotsIsWorldWithoutRobots) {
  write("robots: []\n");
  up();
  run(0.1);
  EXPECT_TRUE(twin_->robots().empty());
}

}  // namespace
}  // namespace doppel::test
