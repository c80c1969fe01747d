// The driver behind topics on a bus of the test, where a node moves an arm and publishes its states.
#include "doppel/devices/topic_driver/topic_hardware.h"

#include <gmock/gmock.h>

#include <cmath>

#include "doppel/description/urdf/load.h"

namespace doppel {
namespace {

using sensor_msgs::msg::JointState;
using testing::AllOf;
using testing::HasSubstr;

constexpr Duration kPeriod{10'000'000};
constexpr double kSpeed = 4, kLimit = 2;  // of the arm's joints: rad/s, rad

std::string two_joints(const std::string& plugin, const std::string& params,
                       const std::string& interface = "position") {
  std::string out = R"(<robot name="two"><link name="l0"/>)";
  std::string hardware = "<ros2_control name=\"Arm\" type=\"system\"><hardware><plugin>" + plugin +
                         "</plugin>" + params + "</hardware>";
  for (int i = 1; i <= 2; ++i) {
    const std::string n = std::to_string(i), before = std::to_string(i - 1);
    out += "<link name=\"l" + n + "\"/><joint name=\"j" + n + "\" type=\"revolute\"><parent link=\"l" +
           before + "\"/><child link=\"l" + n +
           "\"/><axis xyz=\"0 0 1\"/><limit lower=\"-2\" upper=\"2\" effort=\"1\" velocity=\"4\"/></joint>";
    hardware += "<joint name=\"j" + n + "\"><command_interface name=\"" + interface +
                R"("/><state_interface name="position"/><state_interface name="velocity"/></joint>)";
  }
  return out + hardware + "</ros2_control></robot>";
}

// An arm that is where it was commanded to be one period ago, within its speed, and a driver of it.
class TopicBench {
  // Before the driver, which uses them until its end.
  Log log_;
  Diagnostics found_;
  PackageResolver packages_;
  RobotDescription robot_;
  Model model_;
  Bus bus_;
  std::unique_ptr<Edge> edge_;

 public:
  explicit TopicBench(const std::string& params = "", const std::string& plugin = "doppel/Topic",
                      const std::string& interface = "position")
      : robot_(parse_urdf(two_joints(plugin, params, interface), "two.urdf", packages_, found_)),
        model_(compile_model(robot_, BaseKind::fixed, found_)),
        edge_(bus_.attach("arm", {.receives_own = false})) {
    log_.add_sink([this](const LogLine& line) { logged += line.text + "\n"; });
    driver = std::make_unique<TopicHardware>(bus_, "");
  }

  Status initialise() {
    const Status out = driver->on_init({robot_.hardware.front(), model_, log_, 100, diagnostics});
    states.assign(driver->state_interfaces().size(), std::nan(""));
    commands.assign(driver->command_interfaces().size(), std::nan(""));
    return out;
  }
  void configure() {
    ASSERT_TRUE(initialise());
    ASSERT_TRUE(driver->on_configure());
    for (const TopicInfo& topic : bus_.topics()) {
      if (topic.name == driver->setup().commands) edge_->subscribe(topic.id);
    }
    bus_.spin();
  }
  // Up to an active component with claimed joints.
  void start() {
    configure();
    for (int i = 0; i < 10; ++i) ASSERT_EQ(cycle(false), HardwareReturn::ok);
    const Status activated = driver->on_activate();
    ASSERT_TRUE(activated) << activated.why();
    claim();
  }
  void claim() {
    std::vector<std::string> names;
    for (const InterfaceDescription& one : driver->command_interfaces()) names.push_back(one.full_name());
    driver->perform_switch(names, {});
  }

  HardwareReturn cycle(bool writes = true) {
    now += kPeriod;
    bus_.set_now(now);
    take_commands();
    for (std::size_t i = 0; i < 2; ++i) {
      const double most = kSpeed * to_seconds(kPeriod);
      if (std::isfinite(goal[i]) && !stuck) q[i] += std::clamp(goal[i] - q[i], -most, most);
    }
    if (speaks) publish(state());
    bus_.spin();
    const HardwareReturn answer = driver->read(now, kPeriod, states);
    if (answer == HardwareReturn::ok && writes) static_cast<void>(driver->write(now, kPeriod, commands));
    driver->attend();
    return answer;
  }
  HardwareReturn run(double seconds) {
    HardwareReturn answer = HardwareReturn::ok;
    for (int i = 0; i < std::lround(seconds * 100) && answer == HardwareReturn::ok; ++i) answer = cycle();
    return answer;
  }

  [[nodiscard]] Bus& bus() { return bus_; }
  [[nodiscard]] JointState state() const {
    JointState out;
    out.header.stamp = to_time_msg(now + skew);
    out.name = {"j1", "j2"};
    out.position = {q[0], q[1]};
    return out;
  }
  void publish(const JointState& message) {
    ASSERT_TRUE(
        edge_->publish("/arm", driver->setup().states, "sensor_msgs/msg/JointState", to_cdr(message)));
  }
  void take_commands() {
    for (Edge::Incoming incoming; edge_->next(incoming);) {
      JointState message;
      ASSERT_TRUE(from_cdr(incoming.cdr, message));
      ASSERT_EQ(message.name, (std::vector<std::string>{"j1", "j2"}));
      for (std::size_t i = 0; i < 2; ++i) {
        largest_step =
            std::max(largest_step, std::isfinite(goal[i]) ? std::abs(message.position[i] - goal[i]) : 0);
        goal[i] = message.position[i];
      }
      ++commanded;
    }
  }

  Diagnostics diagnostics;
  std::string logged;
  std::unique_ptr<TopicHardware> driver;
  std::vector<double> states, commands;
  Time now{};
  Duration skew = std::chrono::hours(5);  // of the arm's clock
  std::array<double, 2> q{0.3, -0.4}, goal{std::nan(""), std::nan("")};
  double largest_step = 0;
  int commanded = 0;  // messages
  bool speaks = true, stuck = false;
};

std::string refusal(TopicBench& bench) {
  const Status out = bench.driver->on_activate();
  EXPECT_FALSE(out);
  return out ? "" : out.why();
}

std::string error_of(const std::string& params, const std::string& interface = "position") {
  TopicBench bench(params, "topic_based_ros2_control/TopicBasedSystem", interface);
  try {
    static_cast<void>(bench.initialise());
  } catch (const InputError& problem) {
    return problem.what();
  }
  return "";
}

TEST(TopicSetup, DefaultsAreThoseOfTopicBasedRos2Control) {
  TopicBench bench("", "topic_based_ros2_control/TopicBasedSystem");
  ASSERT_TRUE(bench.initialise());
  EXPECT_EQ(bench.driver->setup().commands, "/robot_joint_commands");
  EXPECT_EQ(bench.driver->setup().states, "/robot_joint_states");
  EXPECT_EQ(bench.driver->setup().threshold, 1e-5);
  EXPECT_FALSE(bench.driver->setup().unwraps);
}

TEST(TopicSetup, MisspeltParameterIsErrorWithNearestNameAndPlace) {
  EXPECT_THAT(error_of("<param name=\"joint_state_topic\">/js</param>"),
              AllOf(HasSubstr("two.urdf:1"), HasSubstr("unknown <param> 'joint_state_topic'"),
                    HasSubstr("did you mean 'joint_states_topic'")));
}

TEST(TopicSetup, EveryBadValueIsReportedAtOnce) {
  EXPECT_THAT(
      error_of("<param name=\"fault_after\">soon</param><param name=\"joint_states_topic\">a b</param>"),
      AllOf(HasSubstr("fault_after"), HasSubstr("joint_states_topic")));
  EXPECT_THAT(error_of("", "velocity"), HasSubstr("have no velocity command"));
  EXPECT_THAT(error_of("<param name=\"joint_states_topic\">/robot_joint_commands</param>"),
              HasSubstr("the same topic"));
}

TEST(TopicHardware, WithoutStatesActivationIsRefusedAndNothingIsPublished) {
  TopicBench bench;
  bench.speaks = false;
  bench.configure();
  for (int i = 0; i < 50; ++i) ASSERT_EQ(bench.cycle(false), HardwareReturn::ok);
  EXPECT_THAT(refusal(bench), HasSubstr("no state has arrived on '/robot_joint_states'"));
  EXPECT_THAT(bench.driver->awaits(), HasSubstr("the first states on"));
  bench.take_commands();
  EXPECT_EQ(bench.commanded, 0);
}

TEST(TopicHardware, MovingArmOutsideLimitsOrMissingJointRefusesActivation) {
  TopicBench bench;
  bench.configure();
  for (int i = 0; i < 10; ++i) {
    bench.q[1] += 0.02;
    static_cast<void>(bench.cycle(false));
  }
  EXPECT_THAT(refusal(bench), HasSubstr("a joint moves"));
  bench.q = {0, kLimit + 0.2};
  for (int i = 0; i < 10; ++i) static_cast<void>(bench.cycle(false));
  EXPECT_THAT(refusal(bench), AllOf(HasSubstr("'j2' is at 2.200"), HasSubstr("outside of its limits")));

  TopicBench partial;
  partial.configure();
  partial.speaks = false;
  JointState one = partial.state();
  one.name = {"j1"};
  partial.publish(one);
  static_cast<void>(partial.cycle(false));
  EXPECT_THAT(refusal(partial), HasSubstr("no position of 'j2'"));
  partial.take_commands();
  EXPECT_EQ(partial.commanded, 0);
}

TEST(TopicHardware, OldStatesRefuseActivation) {
  TopicBench bench;
  bench.configure();
  for (int i = 0; i < 10; ++i) static_cast<void>(bench.cycle(false));
  bench.speaks = false;
  for (int i = 0; i < 20; ++i) static_cast<void>(bench.cycle(false));
  EXPECT_THAT(refusal(bench), HasSubstr("the last state on '/robot_joint_states' is 0.20 s old"));
}

TEST(TopicHardware, ActivationMovesNothing) {
  TopicBench bench;
  bench.start();
  ASSERT_EQ(bench.run(0.5), HardwareReturn::ok);
  EXPECT_NEAR(bench.q[0], 0.3, 1e-9);
  EXPECT_NEAR(bench.q[1], -0.4, 1e-9);
  EXPECT_EQ(bench.states[0], 0.3);
  EXPECT_EQ(bench.driver->state(), DriverState::holding);
}

TEST(TopicHardware, FarCommandIsReachedInBoundedSteps) {
  TopicBench bench;
  bench.start();
  bench.commands = {1.5, 5.0};  // the second one is beyond its limit
  ASSERT_EQ(bench.run(1.5), HardwareReturn::ok);
  EXPECT_NEAR(bench.q[0], 1.5, 1e-3);
  EXPECT_NEAR(bench.q[1], kLimit, 1e-3);
  EXPECT_LE(bench.largest_step, 1.2 * kSpeed * to_seconds(kPeriod) + 1e-9);
  EXPECT_THAT(bench.logged, AllOf(HasSubstr("'j1' is commanded faster"), HasSubstr("beyond its limits")));
}

TEST(TopicHardware, GoalStaysNearArmThatDoesNotFollow) {
  TopicBench bench("<param name=\"ahead\">0.1</param>");
  bench.start();
  bench.stuck = true;
  bench.commands = {1.5, 0};
  ASSERT_EQ(bench.run(1), HardwareReturn::ok);
  bench.take_commands();
  EXPECT_NEAR(bench.goal[0], 0.3 + 0.1 * kSpeed, 1e-9);
}

TEST(TopicHardware, SilenceHoldsThenFaultsAndNothingIsResumed) {
  TopicBench bench;
  bench.start();
  bench.commands = {1.5, 1.5};
  ASSERT_EQ(bench.run(0.1), HardwareReturn::ok);
  bench.speaks = false;
  ASSERT_EQ(bench.run(0.1), HardwareReturn::ok);
  EXPECT_EQ(bench.driver->state(), DriverState::degraded);
  EXPECT_THAT(bench.logged, HasSubstr("all joints hold"));
  const double held = bench.states[0];
  bench.take_commands();
  EXPECT_NEAR(bench.goal[0], held, 1e-9) << "the goal is the last known position";
  EXPECT_EQ(bench.run(1), HardwareReturn::error);
  EXPECT_EQ(bench.driver->state(), DriverState::fault);
  EXPECT_THAT(bench.driver->fault(), HasSubstr("'/robot_joint_states' for 0.5 s"));
  ASSERT_TRUE(bench.driver->on_error());
  bench.take_commands();
  const int before = bench.commanded;

  bench.speaks = true;
  ASSERT_TRUE(bench.driver->on_configure());
  for (int i = 0; i < 10; ++i) ASSERT_EQ(bench.cycle(false), HardwareReturn::ok);
  EXPECT_EQ(bench.commanded, before) << "nothing is published before the next activation";
  ASSERT_TRUE(bench.driver->on_activate());
  const double stopped_at = bench.q[0];
  ASSERT_EQ(bench.run(0.5), HardwareReturn::ok) << "the old command has not been given up by its sender";
  EXPECT_NEAR(bench.q[0], stopped_at, 1e-9);
}

TEST(TopicHardware, StatesThatReturnInTimeAreFollowedAgain) {
  TopicBench bench;
  bench.start();
  bench.commands = {0.5, 0};
  bench.speaks = false;
  ASSERT_EQ(bench.run(0.3), HardwareReturn::ok);
  EXPECT_EQ(bench.driver->state(), DriverState::degraded);
  bench.speaks = true;
  ASSERT_EQ(bench.run(0.5), HardwareReturn::ok);
  EXPECT_EQ(bench.driver->state(), DriverState::active);
  EXPECT_NEAR(bench.q[0], 0.5, 1e-3);
  EXPECT_THAT(bench.logged, HasSubstr("arrive again"));
}

TEST(TopicHardware, OneSilentJointIsLossOfAll) {
  TopicBench bench;
  bench.start();
  bench.speaks = false;
  HardwareReturn answer = HardwareReturn::ok;
  for (int i = 0; i < 100 && answer == HardwareReturn::ok; ++i) {
    JointState one = bench.state();
    one.name = {"j1"};
    bench.publish(one);
    answer = bench.cycle();
  }
  EXPECT_EQ(answer, HardwareReturn::error);
}

TEST(TopicHardware, StateThatIsNotNewerIsDropped) {
  TopicBench bench;
  bench.start();
  JointState old = bench.state();
  ASSERT_EQ(bench.run(0.1), HardwareReturn::ok);
  old.position = {0.35, -0.4};
  bench.publish(old);
  bench.speaks = false;
  ASSERT_EQ(bench.cycle(), HardwareReturn::ok);
  EXPECT_EQ(bench.states[0], 0.3);
  EXPECT_THAT(bench.logged, HasSubstr("not newer than those before"));
  DeviceReport report;
  ASSERT_TRUE(bench.driver->report(report));
  EXPECT_EQ(report.damaged, 2u) << "of each joint";
}

TEST(TopicHardware, LateStatesAreDroppedUntilFault) {
  TopicBench bench;
  bench.start();
  bench.skew -= std::chrono::milliseconds(300);  // the network holds them back
  bench.now += std::chrono::milliseconds(300);
  EXPECT_EQ(bench.run(1), HardwareReturn::error);
  EXPECT_THAT(bench.logged, HasSubstr("arrive 0.2 s later than others did"));
}

TEST(TopicHardware, ClockThatIsSetBackIsFollowed) {
  TopicBench bench("<param name=\"fault_after\">1</param>");
  bench.start();
  bench.commands = {0.5, -0.4};
  for (const auto step : {std::chrono::milliseconds(1000), std::chrono::milliseconds(7'200'000)}) {
    bench.skew -= step;
    ASSERT_EQ(bench.run(0.5), HardwareReturn::ok) << bench.logged;
    EXPECT_EQ(bench.driver->state(), DriverState::active);
    EXPECT_THAT(bench.logged, HasSubstr("was set back"));
    bench.logged.clear();
  }
  ASSERT_EQ(bench.run(1), HardwareReturn::ok);
  EXPECT_NEAR(bench.q[0], 0.5, 1e-3);
}

TEST(TopicHardware, ClockThatIsSetBackIsFollowedAfterLateState) {
  TopicBench bench("<param name=\"fault_after\">1</param>");
  bench.start();
  bench.commands = {0.5, -0.4};
  bench.skew -= std::chrono::milliseconds(1000);
  JointState late = bench.state();
  late.header.stamp = to_time_msg(bench.now + bench.skew - std::chrono::milliseconds(150));
  bench.publish(late);
  ASSERT_EQ(bench.run(0.7), HardwareReturn::ok) << bench.logged;
  EXPECT_THAT(bench.logged, HasSubstr("was set back"));
  EXPECT_EQ(bench.driver->state(), DriverState::active);
}

// They come at once, as a network delivers what it has held back.
TEST(TopicHardware, OldStatesThatComeAtOnceAreNoClock) {
  TopicBench bench;
  bench.start();
  ASSERT_EQ(bench.run(0.5), HardwareReturn::ok);
  JointState old = bench.state();
  old.position = {1.0, 1.0};
  for (int i = 0; i < 20; ++i) {
    old.header.stamp = to_time_msg(bench.now + bench.skew - std::chrono::milliseconds(400 - 10 * i));
    bench.publish(old);
  }
  bench.speaks = false;
  ASSERT_EQ(bench.cycle(), HardwareReturn::ok);
  EXPECT_NEAR(bench.states[0], 0.3, 1e-6);
}

TEST(TopicHardware, ClockThatDriftsBySomeHundredPpmIsNoDelay) {
  TopicBench bench;
  bench.start();
  for (int i = 0; i < 360'000; ++i) {  // an hour
    bench.skew -= std::chrono::microseconds(5);
    ASSERT_EQ(bench.cycle(), HardwareReturn::ok) << i;
  }
}

TEST(TopicHardware, JumpOfOneStateIsDropped) {
  TopicBench bench;
  bench.start();
  JointState wrong = bench.state();
  wrong.position = {-1.8, -0.4};
  wrong.header.stamp = to_time_msg(bench.now + bench.skew + std::chrono::milliseconds(1));
  bench.speaks = false;
  bench.publish(wrong);
  ASSERT_EQ(bench.cycle(), HardwareReturn::ok);
  EXPECT_EQ(bench.states[0], 0.3);
  EXPECT_THAT(bench.logged, HasSubstr("'j1' has reported a position that it cannot have reached"));
}

TEST(TopicHardware, StopHoldsAndPublishesOnce) {
  TopicBench bench;
  bench.start();
  bench.commands = {1.5, 1.5};
  ASSERT_EQ(bench.run(0.15), HardwareReturn::ok);
  bench.take_commands();
  const int before = bench.commanded;
  bench.driver->on_stop();
  const double stopped_at = bench.q[0];
  ASSERT_EQ(bench.run(1), HardwareReturn::ok);
  EXPECT_EQ(bench.commanded, before + 1);
  EXPECT_NEAR(bench.q[0], stopped_at, kSpeed * to_seconds(kPeriod) + 1e-9);
}

TEST(TopicHardware, NothingIsPublishedWhileArmIsWhereItShallBe) {
  TopicBench bench;
  bench.start();
  ASSERT_EQ(bench.run(1), HardwareReturn::ok);
  bench.take_commands();
  EXPECT_EQ(bench.commanded, 1) << "the first goal, which is the present position";
}

TEST(TopicHardware, VelocityIsThatOfPositionsWhereNodeSendsNone) {
  TopicBench bench;
  bench.start();
  EXPECT_EQ(bench.states[1], 0);
  bench.commands = {1.5, -0.4};
  ASSERT_EQ(bench.run(0.2), HardwareReturn::ok);
  EXPECT_NEAR(bench.states[1], kSpeed, 1e-6);
  EXPECT_NEAR(bench.states[3], 0, 1e-6);
}

TEST(TopicHardware, WrappedStatesAreSummed) {
  TopicBench bench("<param name=\"sum_wrapped_joint_states\">true</param>");
  bench.configure();
  bench.speaks = false;
  for (const double angle : {3.0, 3.1, 3.1 - 2 * M_PI + 0.1, 3.1 - 2 * M_PI + 0.2}) {
    bench.now += kPeriod;
    JointState one = bench.state();
    one.position = {angle, 0};
    bench.publish(one);
    static_cast<void>(bench.cycle(false));
  }
  EXPECT_NEAR(bench.states[0], 3.3, 1e-9);
}

TEST(TopicHardware, OwnBroadcasterOnTopicOfStatesIsFault) {
  TopicBench bench;
  bench.start();
  Bus& bus = bench.bus();
  Node broadcaster(bus, "/joint_state_broadcaster");
  static_cast<void>(broadcaster.advertise<JointState>("/robot_joint_states"));
  EXPECT_EQ(bench.run(0.1), HardwareReturn::error);
  EXPECT_THAT(bench.driver->fault(), HasSubstr("'/joint_state_broadcaster' of this program"));
}

}  // namespace
}  // namespace doppel
