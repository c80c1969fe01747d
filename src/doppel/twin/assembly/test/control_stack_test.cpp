// A controller file that the user did not name never prevents a robot from loading: the controllers that fit
// run, and the remaining joints are held.
#include "doppel/twin/loop/control_stack.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "doppel/control/manager/rates.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/twin/assembly/runner.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

std::string solid_link(const std::string& name) {
  return "<link name=\"" + name +
         "\"><inertial><mass value=\"0.5\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" "
         "ixz=\"0\" iyz=\"0\"/></inertial></link>";
}

std::string solid_joint(const std::string& name, const std::string& parent, const std::string& child) {
  return "<joint name=\"" + name + "\" type=\"revolute\"><origin xyz=\"0 0 0.5\"/><parent link=\"" + parent +
         "\"/><child link=\"" + child +
         "\"/><axis xyz=\"0 1 0\"/><limit lower=\"-1\" upper=\"1\" effort=\"50\" velocity=\"2\"/></joint>";
}

const std::string kStackArm = "<robot name=\"arm\">" + solid_link("base") + solid_link("upper") +
                              solid_link("lower") + solid_joint("shoulder", "base", "upper") +
                              solid_joint("elbow", "upper", "lower");
const std::string kBroadcaster = "    jsb: {type: joint_state_broadcaster/JointStateBroadcaster}\n";

std::string manager(const std::string& controllers) {
  return "controller_manager:\n  ros__parameters:\n    update_rate: 100\n" + controllers;
}
std::string trajectories(const std::string& name, const std::string& joints) {
  return name + ":\n  ros__parameters:\n    joints: " + joints +
         "\n    command_interfaces: [position]\n    state_interfaces: [position, velocity]\n";
}
std::string declared(const std::string& name, const std::string& type) {
  return "    " + name + ": {type: " + type + "}\n";
}
const std::string kJtc = "joint_trajectory_controller/JointTrajectoryController";

class FoundControllersTest : public ::testing::Test {
 protected:
  FoundControllersTest()
      : folder_(fs::temp_directory_path() / ("doppel_stack_" + std::to_string(::getpid())) / "arm") {
    fs::create_directories(folder_ / "config");
    std::ofstream(folder_ / "package.xml") << "<package format=\"3\"><name>arm</name></package>";
    log_.add_sink([this](const LogLine& line) { said_ += line.text + '\n'; });
  }
  ~FoundControllersTest() override { fs::remove_all(folder_.parent_path()); }

  // The loaded controllers, and what each claims.
  std::map<std::string, std::vector<std::string>> up(const std::string& yaml, const std::string& more = "",
                                                     bool named = false) {
    std::ofstream(folder_ / "arm.urdf") << kStackArm + more + "</robot>";
    std::ofstream(folder_ / "config/controllers.yaml") << yaml;
    Scenario scenario;
    scenario.robots = {{.target = (folder_ / "arm.urdf").string()}};
    if (named) scenario.robots.front().controllers = {folder_ / "config/controllers.yaml"};
    said_.clear();
    Diagnostics diagnostics;
    Twin twin(scenario, log_, diagnostics);
    for (const Diagnostic& d : diagnostics.all()) said_ += d.rule + ": " + d.message + '\n';
    origin_ = twin.robot().controllers_origin();
    std::map<std::string, std::vector<std::string>> out;
    for (const ControllerView& c : twin.robot().controller_manager().controllers()) out[c.name] = c.claimed;
    // Generated controllers are generated again after an edit.
    const auto replacement = Twin::prepare(twin.running(), diagnostics);
    static_cast<void>(twin.replace(replacement));
    EXPECT_EQ(twin.robot().controller_manager().controllers().size(), out.size());
    return out;
  }

  // Deactivates `name`, edits the YAML, and returns the active controllers after the edit.
  std::vector<std::string> active_after_edit(const std::string& yaml, const std::string& name,
                                             const std::string& edited) {
    std::ofstream(folder_ / "arm.urdf") << kStackArm + "</robot>";
    std::ofstream(folder_ / "config/controllers.yaml") << yaml;
    Scenario scenario;
    scenario.robots = {{.target = (folder_ / "arm.urdf").string()}};
    Diagnostics diagnostics;
    Twin twin(scenario, log_, diagnostics);
    const std::vector<std::string> off{name};
    EXPECT_TRUE(twin.robot().controller_manager().switch_controllers({}, off, Strictness::strict));
    const std::size_t before = twin.robot().controller_manager().controllers().size();
    std::ofstream(folder_ / "config/controllers.yaml") << edited;
    for (int i = 0; i < 2; ++i) {  // what one edit keeps, the next one keeps as well
      const auto replacement = Twin::prepare(twin.running(), diagnostics);
      static_cast<void>(twin.replace(replacement));
      std::ofstream(folder_ / "config/controllers.yaml") << edited + "# once more\n";
    }
    EXPECT_EQ(twin.robot().controller_manager().controllers().size(), before);
    std::vector<std::string> out;
    for (const ControllerView& c : twin.robot().controller_manager().controllers()) {
      if (c.state == ControllerState::active) out.push_back(c.name);
    }
    return out;
  }

  fs::path folder_;
  Log log_;
  std::string said_, origin_;
};

TEST_F(FoundControllersTest, CompatibleControllersRunWithoutAdditions) {
  const auto there =
      up(manager(kBroadcaster + declared("arm", kJtc)) + trajectories("arm", "[shoulder, elbow]"));
  EXPECT_THAT(there, ElementsAre(Pair("arm", ElementsAre("shoulder/position", "elbow/position")),
                                 Pair("jsb", IsEmpty())));
  EXPECT_EQ(said_.find("up.joints"), std::string::npos) << said_;
  EXPECT_EQ(origin_, (folder_ / "config/controllers.yaml").string());
}

TEST_F(FoundControllersTest, UnavailableTypeIsLeftOut) {
  const auto there =
      up(manager(kBroadcaster + declared("base", "admittance_controller/AdmittanceController") +
                 declared("arm", kJtc)) +
         "base:\n  ros__parameters:\n    joints: [shoulder]\n" + trajectories("arm", "[shoulder, elbow]"));
  EXPECT_EQ(there.count("base"), 0U);
  EXPECT_EQ(there.at("arm").size(), 2U);
  EXPECT_THAT(said_,
              HasSubstr("'admittance_controller/AdmittanceController' of ROS 2 Jazzy is not available"));
  EXPECT_THAT(said_, HasSubstr("'base' is not started, the others are"));
  EXPECT_THAT(said_, HasSubstr("controllers.yaml:5"));
}

TEST_F(FoundControllersTest, MisspeltTypeIsLeftOutWithNearest) {
  const auto there = up(manager(declared("arm", "joint_trajectory_controller/JointTrajectoryControler")));
  EXPECT_THAT(said_, HasSubstr("did you mean 'joint_trajectory_controller/JointTrajectoryController'?"));
  EXPECT_THAT(said_, HasSubstr("'arm' is not started"));
  EXPECT_EQ(said_.find("the others are"), std::string::npos)
      << "expected no mention of other controllers: there are none";
  EXPECT_EQ(origin_, (folder_ / "config/controllers.yaml").string() + " and generated");
  EXPECT_THAT(there, ElementsAre(Pair("joint_state_broadcaster", IsEmpty()),
                                 Pair("joint_trajectory_controller",
                                      ElementsAre("shoulder/position", "elbow/position"))));
}

TEST_F(FoundControllersTest, ControllerWithUnknownJointIsLeftOut) {
  const auto there = up(manager(kBroadcaster + declared("arm", kJtc) + declared("hand", kJtc)) +
                        trajectories("arm", "[shoulder, elbow]") + trajectories("hand", "[finger]"));
  EXPECT_EQ(there.count("hand"), 0U);
  EXPECT_EQ(there.at("arm").size(), 2U);
  EXPECT_THAT(said_, HasSubstr("lists joint 'finger'"));
}

TEST_F(FoundControllersTest, UndrivenJointsAreHeld) {
  const auto there = up(manager(kBroadcaster + declared("joint_trajectory_controller", kJtc)) +
                        trajectories("joint_trajectory_controller", "[shoulder]"));
  EXPECT_THAT(there.at("joint_trajectory_controller"), ElementsAre("shoulder/position"));
  EXPECT_THAT(there.at("joint_trajectory_controller_rest"), ElementsAre("elbow/position"));
  EXPECT_THAT(said_, HasSubstr("no loaded controller commands 'elbow'"));
}

TEST_F(FoundControllersTest, DeactivatedControllersJointsStayReleasedAfterReload) {
  const std::string yaml =
      manager(kBroadcaster + declared("arm", kJtc)) + trajectories("arm", "[shoulder, elbow]");
  EXPECT_THAT(active_after_edit(yaml, "arm", yaml + "# edited\n"), ElementsAre("jsb"));
}

TEST_F(FoundControllersTest, DeactivatedGeneratedControllerStaysInactiveAfterReload) {
  const std::string yaml = manager(kBroadcaster + declared("arm", kJtc)) + trajectories("arm", "[shoulder]");
  EXPECT_THAT(active_after_edit(yaml, "joint_trajectory_controller", yaml + "# edited\n"),
              UnorderedElementsAre("jsb", "arm"));
  EXPECT_THAT(active_after_edit(yaml, "arm", yaml + "# edited\n"),
              UnorderedElementsAre("jsb", "joint_trajectory_controller"));
}

TEST_F(FoundControllersTest, DeactivatedBroadcasterIsNotReplacedAfterReload) {
  const std::string yaml =
      manager(kBroadcaster + declared("arm", kJtc)) + trajectories("arm", "[shoulder, elbow]");
  EXPECT_THAT(active_after_edit(yaml, "jsb", yaml + "# edited\n"), ElementsAre("arm"));
  const std::string without = manager(declared("arm", kJtc)) + trajectories("arm", "[shoulder, elbow]");
  EXPECT_THAT(active_after_edit(without, "joint_state_broadcaster", without + "# edited\n"),
              ElementsAre("arm"));
}

TEST_F(FoundControllersTest, ConflictingClaimPrefersTrajectoryController) {
  const auto there =
      up(manager(kBroadcaster + declared("fast", "position_controllers/JointGroupPositionController") +
                 declared("arm", kJtc)) +
         "fast:\n  ros__parameters:\n    joints: [shoulder, elbow]\n" +
         trajectories("arm", "[shoulder, elbow]"));
  EXPECT_EQ(there.at("arm").size(), 2U);
  EXPECT_THAT(there.at("fast"), IsEmpty());
  EXPECT_THAT(said_, HasSubstr("'fast' stays inactive: the command interface"));
}

TEST_F(FoundControllersTest, ControllerWithBadParameterIsLeftOut) {
  const auto there =
      up(manager(kBroadcaster + declared("arm", kJtc)) +
         "arm:\n  ros__parameters:\n    joints: [shoulder, elbow]\n    command_interfaces: 3\n");
  EXPECT_EQ(there.count("arm"), 0U);
  EXPECT_EQ(there.at("joint_trajectory_controller").size(), 2U);
  EXPECT_THAT(said_, HasSubstr("controllers.yaml:9:25"));
}

TEST_F(FoundControllersTest, ControllerWithMissingInterfaceIsLeftOut) {
  const std::string hardware =
      "<ros2_control name=\"s\" type=\"system\"><hardware><plugin>mock_components/GenericSystem</plugin>"
      "</hardware><joint name=\"shoulder\"><command_interface name=\"position\"/>"
      "<state_interface name=\"position\"/></joint><joint name=\"elbow\">"
      "<command_interface name=\"velocity\"/><state_interface name=\"position\"/></joint>"
      "<joint name=\"ghost\"><command_interface name=\"position\"/></joint></ros2_control>";
  const auto there =
      up(manager(kBroadcaster + declared("arm", kJtc)) + trajectories("arm", "[shoulder, elbow]"), hardware);
  EXPECT_EQ(there.count("arm"), 0U);
  EXPECT_THAT(there.at("joint_trajectory_controller"), ElementsAre("shoulder/position"));
  EXPECT_THAT(there.at("velocity_controller"), ElementsAre("elbow/velocity"))
      << "expected the joint to be held at zero velocity";
}

TEST_F(FoundControllersTest, EffortOnlyJointsArePassive) {
  const std::string hardware =
      "<ros2_control name=\"s\" type=\"system\"><hardware><plugin>mock_components/GenericSystem</plugin>"
      "</hardware><joint name=\"shoulder\"><command_interface name=\"position\"/>"
      "<state_interface name=\"position\"/></joint><joint name=\"elbow\">"
      "<command_interface name=\"effort\"/><state_interface name=\"position\"/></joint></ros2_control>";
  up(manager(kBroadcaster), hardware);
  EXPECT_THAT(
      said_,
      HasSubstr(
          "no controller commands 'elbow', which takes effort commands only: passive; it moves freely"));
}

TEST_F(FoundControllersTest, UnknownJointOfReplacedHardwareIsReported) {
  const std::string hardware =
      "<ros2_control name=\"s\" type=\"system\"><hardware><plugin>mock_components/GenericSystem</plugin>"
      "</hardware><joint name=\"sholder\"><command_interface name=\"position\"/>"
      "<state_interface name=\"position\"/></joint></ros2_control>";
  up("some_node:\n  ros__parameters:\n    rate: 1\n", hardware);
  EXPECT_THAT(said_, HasSubstr("ros2_control.unknown_joint: <ros2_control> 's' lists the joint 'sholder'"));
  EXPECT_THAT(said_, HasSubstr("did you mean 'shoulder'?"));
  EXPECT_THAT(said_, HasSubstr("up.hardware_generated"));
}

TEST_F(FoundControllersTest, NamespacedControllersAreReportedWithNamespace) {
  const std::string yaml = "/my/" + manager(kBroadcaster + declared("arm", kJtc)) + "/my/" +
                           trajectories("arm", "[shoulder, elbow]");
  const auto there = up(yaml);
  EXPECT_EQ(there.count("arm"), 0U);
  EXPECT_THAT(said_, HasSubstr("up.controllers_of_other_manager: the controllers of this file belong to "
                               "'/my/controller_manager'; the manager here is '/controller_manager'"));
  up(manager(kBroadcaster + declared("arm", kJtc)) + trajectories("arm", "[shoulder, elbow]"));
  EXPECT_EQ(said_.find("up.controllers_of_other_manager"), std::string::npos) << said_;
}

TEST_F(FoundControllersTest, DuplicateInterfaceIsLeftOut) {
  std::string hardware =
      "<ros2_control name=\"s\" type=\"system\"><hardware><plugin>mock_components/GenericSystem</plugin>"
      "</hardware>";
  for (const char* name : {"shoulder", "elbow"})
    hardware += std::string("<joint name=\"") + name +
                "\"><command_interface name=\"position\"/><state_interface name=\"position\"/></joint>";
  hardware += "</ros2_control>";
  const auto there = up(manager(kBroadcaster), hardware + hardware);
  EXPECT_EQ(there.at("joint_trajectory_controller").size(), 2U);
}

TEST_F(FoundControllersTest, NamedFileIsTakenUnchanged) {
  EXPECT_THROW(up(manager(declared("arm", kJtc)) + trajectories("arm", "[ghost]"), "", true), InputError);
  const auto there =
      up(manager(kBroadcaster + declared("arm", kJtc)) + trajectories("arm", "[shoulder]"), "", true);
  EXPECT_THAT(there, ElementsAre(Pair("arm", ElementsAre("shoulder/position")), Pair("jsb", IsEmpty())));
}

std::string system_of(const std::string& name, const std::string& plugin, const std::string& of_joint) {
  return "<ros2_control name=\"" + name + "\" type=\"system\"><hardware><plugin>" + plugin +
         "</plugin></hardware><joint name=\"" + of_joint +
         "\"><command_interface name=\"position\"/><state_interface "
         "name=\"position\"/></joint></ros2_control>";
}

TEST_F(FoundControllersTest, RegisteredPluginIsRealAndOthersAreSimulated) {
  std::ofstream(folder_ / "arm.urdf") << kStackArm + system_of("Real", "doppel/Loopback", "shoulder") +
                                             system_of("Unknown", "my_arm/MyArmSystem", "elbow") + "</robot>";
  std::ofstream(folder_ / "config/controllers.yaml")
      << manager(kBroadcaster + declared("group", "position_controllers/JointGroupPositionController")) +
             "group:\n  ros__parameters:\n    joints: [shoulder, elbow]\n";
  Scenario scenario;
  scenario.robots = {{.target = (folder_ / "arm.urdf").string()}};
  Diagnostics diagnostics;
  Twin twin(scenario, log_, diagnostics);
  std::vector<std::string> rules;
  for (const Diagnostic& d : diagnostics.all()) rules.push_back(d.rule);
  EXPECT_THAT(rules, ::testing::IsSupersetOf({"ros2_control.plugin_real", "ros2_control.plugin_simulated"}));
  Node speaker(twin.bus(), "/speaker");
  const auto commands = speaker.advertise<std_msgs::msg::Float64MultiArray>("/group/commands");
  // Its loop runs in wall-clock time, independent of the simulation and its reloads.
  const auto reaches = [&twin](double shoulder, double elbow) {
    bool there = false;
    for (int i = 0; i < 5000 && !there; ++i) {
      twin.bus().post([&] {
        const ControllerManager& control = twin.robot().controller_manager();
        there = std::abs(control.state("shoulder/position") - shoulder) < 0.02 &&
                std::abs(control.state("elbow/position") - elbow) < 0.02;
      });
      twin.between_steps();
      twin.step();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return there;
  };
  twin.bus().post([&] { commands.publish({{}, {0.5, 0.25}}, twin.now()); });
  EXPECT_TRUE(reaches(0.5, 0.25));
  twin.bus().post([&] {
    const auto replacement = Twin::prepare(twin.running(), diagnostics);
    EXPECT_EQ(twin.replace(replacement), Twin::Reload::controllers_kept);
  });
  twin.bus().post([&] { commands.publish({{}, {-0.5, -0.25}}, twin.now()); });
  EXPECT_TRUE(reaches(-0.5, -0.25));
}

// For the arm in the folder, whose only controller publishes the joint states at 1000 Hz.
Scenario broadcasting_at_1000_hz(const std::filesystem::path& folder) {
  std::ofstream(folder / "config/controllers.yaml")
      << "controller_manager:\n  ros__parameters:\n    update_rate: 1000\n" + kBroadcaster;
  Scenario scenario;
  scenario.robots = {{.target = (folder / "arm.urdf").string()}};
  return scenario;
}

TEST_F(FoundControllersTest, HardwareLoopOfReloadStartsAfterReload) {
  const auto write = [this](const std::string& hardware) {
    std::ofstream(folder_ / "arm.urdf") << kStackArm + hardware + "</robot>";
  };
  write("");
  const Scenario scenario = broadcasting_at_1000_hz(folder_);
  Diagnostics diagnostics;
  Twin twin(scenario, log_, diagnostics);
  const auto edge = twin.bus().attach("/test");
  for (const TopicInfo& topic : twin.bus().topics())
    if (topic.name == "/joint_states") edge->subscribe(topic.id);
  const auto received = [&edge] {
    Edge::Incoming message;
    int count = 0;
    while (edge->next(message)) ++count;
    return count;
  };
  constexpr auto kManyTicks = std::chrono::milliseconds(100);
  write(system_of("Real", "doppel/Loopback", "shoulder"));
  twin.bus().post([&] {
    twin.replace(Twin::prepare(twin.running(), diagnostics));
    received();
    std::this_thread::sleep_for(kManyTicks);
    EXPECT_EQ(received(), 0);
  });
  twin.between_steps();
  int count = 0;
  for (int i = 0; i < 200 && count == 0; ++i) {
    std::this_thread::sleep_for(kManyTicks);
    count = received();
  }
  EXPECT_GT(count, 0);
}

TEST_F(FoundControllersTest, RunnerStatusAndHardwareLoopMessagesReachEdge) {
  std::ofstream(folder_ / "arm.urdf")
      << kStackArm + system_of("Real", "doppel/Loopback", "shoulder") + "</robot>";
  const Scenario scenario = broadcasting_at_1000_hz(folder_);
  Diagnostics diagnostics;
  Twin twin(scenario, log_, diagnostics);
  Runner runner(twin, {});
  const auto edge = twin.bus().attach("/test");
  std::map<TopicId, const TypeSupport*> types;
  for (const TopicInfo& topic : twin.bus().topics()) {
    edge->subscribe(topic.id);
    types[topic.id] = find_type(topic.type);
  }
  // A change of speed is reported at once: one status per step.
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(500);
  std::atomic<bool> stop{false};
  const std::function<void()> hurry = [&] {
    double& speed = twin.time_control().speed;
    speed = speed == 1.0 ? 2.0 : 1.0;
    stop = std::chrono::steady_clock::now() > end;
    twin.bus().post(hurry);
  };
  twin.bus().post(hurry);
  runner.run(stop);
  std::map<std::string, int> received;
  Edge::Incoming message;
  while (edge->next(message)) {
    ASSERT_TRUE(types.contains(message.topic)) << message.topic;
    Bytes read;
    const Status whole = types[message.topic]->recode(message.cdr, read);
    EXPECT_TRUE(whole.ok()) << types[message.topic]->name << ": " << whole.why();
    ++received[types[message.topic]->name];
  }
  EXPECT_GT(received["sensor_msgs/msg/JointState"], 50);
  EXPECT_GT(received["doppel_msgs/msg/TwinStatus"], 50);
}

TEST_F(FoundControllersTest, EmergencyStopSurvivesControllerRecreation) {
  const std::string yaml =
      manager(kBroadcaster + declared("arm", kJtc)) + trajectories("arm", "[shoulder, elbow]");
  std::ofstream(folder_ / "arm.urdf") << kStackArm + "</robot>";
  std::ofstream(folder_ / "config/controllers.yaml") << yaml;
  Scenario scenario;
  scenario.robots = {{.target = (folder_ / "arm.urdf").string()}};
  Diagnostics diagnostics;
  Twin twin(scenario, log_, diagnostics);
  twin.robot().controller_manager().stop("the test");
  std::ofstream(folder_ / "config/controllers.yaml") << yaml + "# edited\n";
  const auto replacement = Twin::prepare(twin.running(), diagnostics);
  ASSERT_EQ(twin.replace(replacement), Twin::Reload::controllers_recreated);
  EXPECT_TRUE(twin.robot().controller_manager().is_stopped());
  ASSERT_TRUE(twin.robot().controller_manager().reset_stop().ok());
  for (const ControllerView& c : twin.robot().controller_manager().controllers())
    EXPECT_EQ(c.state, ControllerState::active) << c.name;
}

TEST_F(FoundControllersTest, FixedBaseIsNamedByRootAboveFloatingJoint) {
  std::ofstream(folder_ / "arm.urdf") << "<robot name=\"f\">" + solid_link("stand") + solid_link("drone") +
                                             "<joint name=\"j\" type=\"floating\"><parent "
                                             "link=\"stand\"/><child link=\"drone\"/></joint></robot>";
  Scenario scenario;
  scenario.robots = {{.target = (folder_ / "arm.urdf").string()}};
  Diagnostics diagnostics;
  const Twin twin(scenario, log_, diagnostics);
  const auto note = std::ranges::find(diagnostics.all(), "up.base_fixed", &Diagnostic::rule);
  ASSERT_NE(note, diagnostics.all().end());
  EXPECT_THAT(note->message, HasSubstr("the root link 'stand' is fixed"));
}

TEST_F(FoundControllersTest, TransmissionsWithoutEffectAreNoted) {
  const std::string transmission =
      "<transmission name=\"t\" type=\"pr2_mechanism_model/SimpleTransmission\"><actuator name=\"m\"/>"
      "<joint name=\"elbow\"/><mechanicalReduction>12</mechanicalReduction></transmission>";
  const std::string plain =
      "<transmission name=\"p\"><type>transmission_interface/SimpleTransmission</type><joint name=\"elbow\"/>"
      "<actuator name=\"m\"><mechanicalReduction>1</mechanicalReduction></actuator></transmission>";
  up(manager(kBroadcaster), transmission + plain);
  EXPECT_THAT(said_, HasSubstr("up.transmission: the type 'pr2_mechanism_model/SimpleTransmission', "
                               "mechanicalReduction 12 of 'elbow' in the transmission 't' have no effect"));
  EXPECT_THAT(said_, ::testing::Not(HasSubstr("transmission 'p'")));
}

TEST(StepForRates, StepDividesEveryPeriodOrThereIsNone) {
  const Duration step(1'000'000);
  const auto of = [&](std::vector<double> rates) { return step_for_rates(rates, step); };
  EXPECT_EQ(of({225}), Duration(888'889));  // five in a period
  EXPECT_EQ(of({200, 100}), step);
  const auto both = of({225, 100});
  ASSERT_TRUE(both.has_value());
  EXPECT_EQ(*both, Duration(555'556));  // 1800 Hz
  EXPECT_EQ(of({225, 223, 227}), std::nullopt);
}

TEST_F(FoundControllersTest, StepFollowsRateOfControllersUnlessWorldSetsIt) {
  std::ofstream(folder_ / "arm.urdf") << kStackArm + "</robot>";
  std::string yaml = manager(kBroadcaster + declared("arm", kJtc)) + trajectories("arm", "[shoulder, elbow]");
  const std::size_t rate = yaml.find("update_rate: ");
  ASSERT_NE(rate, std::string::npos) << yaml;
  yaml.replace(rate, yaml.find('\n', rate) - rate, "update_rate: 225");
  std::ofstream(folder_ / "config/controllers.yaml") << yaml;
  Scenario scenario;
  scenario.robots = {{.target = (folder_ / "arm.urdf").string()}};
  {
    Diagnostics diagnostics;
    const Twin twin(scenario, log_, diagnostics);
    EXPECT_EQ(twin.step_size(), Duration(888'889));
    EXPECT_EQ(std::ranges::count(diagnostics.all(), "control.step_chosen", &Diagnostic::rule), 1);
    EXPECT_EQ(std::ranges::count(diagnostics.all(), "control.rate_rounded", &Diagnostic::rule), 0);
  }
  std::ofstream(folder_ / "w.yaml") << "step: 0.001\n";
  scenario.world = folder_ / "w.yaml";
  Diagnostics diagnostics;
  const Twin twin(scenario, log_, diagnostics);
  EXPECT_EQ(twin.step_size(), Duration(1'000'000));
  const auto rounded = std::ranges::find(diagnostics.all(), "control.rate_rounded", &Diagnostic::rule);
  ASSERT_NE(rounded, diagnostics.all().end());
  EXPECT_THAT(rounded->fix, HasSubstr("`step: 0.000888889`"));
}

TEST(PeriodInSteps, IndivisibleRateIsRoundedWithWarning) {
  Diagnostics diagnostics;
  const Duration step(1'000'000);
  EXPECT_EQ(period_in_steps(200, step, {}, diagnostics), Duration(5'000'000));
  EXPECT_TRUE(diagnostics.all().empty());
  EXPECT_EQ(period_in_steps(225, step, {}, diagnostics), Duration(4'000'000));
  ASSERT_EQ(diagnostics.all().size(), 1u);
  EXPECT_THAT(
      diagnostics.all()[0].message,
      HasSubstr("225 Hz does not divide the physics rate of 1000 Hz; the controller manager runs every 4 "
                "steps, at 250 Hz"));
  EXPECT_EQ(period_in_steps(5000, step, {}, diagnostics), step);
  EXPECT_EQ(diagnostics.all().size(), 2u);
}

}  // namespace
}  // namespace doppel
