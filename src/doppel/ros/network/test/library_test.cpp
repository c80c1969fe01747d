// The client library as its users see it: programs that communicate over loopback.

#include <gmock/gmock.h>

#include <csignal>

#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/network/action_client.h"
#include "library_peer.h"

namespace doppel::ros2 {
namespace {

using namespace std::chrono_literals;
using std_srvs::srv::SetBool;
using test::kTimeout;
using test::Peer;
using test::quiet_context;
using testing::HasSubstr;
using Text = std_msgs::msg::String;

class ClientLibraryTest : public testing::Test {
 protected:
  [[nodiscard]] ContextOptions options(std::vector<std::string> ros_args = {}) const {
    ContextOptions options = quiet_context(domain_);
    if (!ros_args.empty()) ros_args.insert(ros_args.begin(), "--ros-args");
    options.arguments = take_ros_arguments(ros_args, NameRules(true));
    return options;
  }
  test::OwnDomain domain_;
};

TEST_F(ClientLibraryTest, PublisherReachesSubscription) {
  Peer talker(options(), [](Context& context) {
    struct Talker {
      explicit Talker(Context& context) : node(context, "talker") {
        out = node.create_publisher<Text>("chatter");
        timer = node.create_wall_timer(5ms, [this] { out.publish({"hello " + std::to_string(++count)}); });
      }
      Node node;
      Publisher<Text> out;
      std::shared_ptr<Timer> timer;
      int count = 0;
    };
    return std::make_unique<Talker>(context);
  });
  Context context(options());
  Node node(context, "listener");
  std::vector<std::string> received;
  node.create_subscription<Text>("chatter", [&](const Text& text) { received.push_back(text.data); });
  ASSERT_TRUE(context.spin_until([&] { return received.size() >= 10; }, kTimeout));
  EXPECT_THAT(received.front(), HasSubstr("hello "));
  const auto sees_talker = [&] {
    const auto graph = context.graph();
    return std::ranges::find(graph->nodes, "/talker", &GraphNode::name) != graph->nodes.end();
  };
  EXPECT_TRUE(context.spin_until(sees_talker, kTimeout));
}

TEST_F(ClientLibraryTest, LateSubscriptionReceivesLatched) {
  Peer early(options(), [](Context& context) {
    auto node = std::make_unique<Node>(context, "early");
    node->create_publisher<Text>("/description", {.depth = 1, .latched = true}).publish({"once"});
    return node;
  });
  Context context(options());
  Node node(context, "late");
  std::string received;
  node.create_subscription<Text>("/description", [&](const Text& text) { received = text.data; },
                                 {.depth = 1, .latched = true});
  EXPECT_TRUE(context.spin_until([&] { return received == "once"; }, kTimeout));
}

std::unique_ptr<Node> switch_node(Context& context) {
  auto node = std::make_unique<Node>(context, "switch", "lab");
  node->create_service<SetBool>("~/set", [](const SetBool::Request& request, SetBool::Response& response) {
    response.success = request.data;
    response.message = "was asked";
  });
  return node;
}

TEST_F(ClientLibraryTest, CallsServices) {
  Peer server(options(), switch_node);
  Context context(options());
  Node node(context, "caller");
  auto client = node.create_client<SetBool>("/lab/switch/set");
  const auto response = client.call({true}, kTimeout);
  ASSERT_TRUE(response);
  EXPECT_TRUE(response->success);
  EXPECT_EQ(response->message, "was asked");

  std::future<SetBool::Response> later = client.async_send_request({false});
  ASSERT_TRUE(context.spin_until([&] { return later.wait_for(0s) == std::future_status::ready; }, kTimeout));
  EXPECT_FALSE(later.get().success);

  EXPECT_FALSE(node.create_client<SetBool>("/nobody").call({true}, 50ms));
  server.stop();
  EXPECT_TRUE(context.spin_until([&] { return !client.service_is_ready(); }, kTimeout));
}

using Follow = control_msgs::action::FollowJointTrajectory;

// Accepts goals with points; finishes them successfully when `finish` is set, or when they are canceled.
struct Arm {
  explicit Arm(Context& context, std::atomic<bool>& finish) : node(context, "arm") {
    server = node.create_action_server<Follow>("~/follow",
                                               {.on_goal =
                                                    [this](const GoalId& id, const Follow::Goal& wanted) {
                                                      if (wanted.trajectory.points.empty())
                                                        return Status::refused("no points");
                                                      goal = id;
                                                      server->set_executing(id);
                                                      return Status();
                                                    },
                                                .on_cancel =
                                                    [this](const GoalId& id) {
                                                      server->set_canceling(id);
                                                      server->finish(id, GoalStatus::canceled, {});
                                                      goal.reset();
                                                      return Status();
                                                    }});
    timer = node.create_wall_timer(5ms, [this, &finish] {
      if (!goal) return;
      Follow::Feedback feedback;
      feedback.joint_names = {"elbow"};
      server->publish_feedback(*goal, feedback);
      if (!finish) return;
      Follow::Result result;
      result.error_string = "fine";
      server->finish(*std::exchange(goal, std::nullopt), GoalStatus::succeeded, result);
    });
  }
  Node node;
  std::optional<GoalId> goal;
  std::unique_ptr<ActionServer<Follow>> server;
  std::shared_ptr<Timer> timer;
};

TEST_F(ClientLibraryTest, SendsGoals) {
  std::atomic<bool> finish = false;
  Peer server(options(), [&](Context& context) { return std::make_unique<Arm>(context, finish); });
  Context context(options());
  Node node(context, "mover");
  ActionClient<Follow> client(node, "/arm/follow");
  ASSERT_TRUE(client.wait_for_action_server(kTimeout));

  Follow::Goal wanted;
  auto rejected = client.send_goal(wanted);
  ASSERT_TRUE(client.wait_for_result(*rejected, kTimeout));
  EXPECT_TRUE(rejected->is_rejected());

  wanted.trajectory.points.resize(1);
  int feedbacks = 0;
  auto goal = client.send_goal(
      wanted, {.on_response = {}, .on_feedback = [&](const auto&) { ++feedbacks; }, .on_result = {}});
  ASSERT_TRUE(context.spin_until([&] { return feedbacks > 2; }, kTimeout));
  EXPECT_EQ(goal->status(), GoalStatus::executing);
  finish = true;
  ASSERT_TRUE(client.wait_for_result(*goal, kTimeout));
  EXPECT_EQ(goal->status(), GoalStatus::succeeded);
  EXPECT_EQ(goal->result().error_string, "fine");

  finish = false;
  auto canceled = client.send_goal(wanted);
  ASSERT_TRUE(context.spin_until([&] { return canceled->status() == GoalStatus::executing; }, kTimeout));
  bool taken = false;
  client.cancel(*canceled, [&](bool canceling) { taken = canceling; });
  ASSERT_TRUE(client.wait_for_result(*canceled, kTimeout));
  EXPECT_EQ(canceled->status(), GoalStatus::canceled);
  EXPECT_TRUE(context.spin_until([&] { return taken; }, kTimeout));
}

TEST_F(ClientLibraryTest, CommandLineSetsNamesAndParameters) {
  Context context(options({"-r", "__ns:=/left", "-r", "chatter:=speech", "-p", "gain:=2", "-p",
                           "arm:other:=7", "-p", "names:=[a, b]"}));
  Node node(context, "arm");
  EXPECT_EQ(node.name(), "/left/arm");
  EXPECT_EQ(node.declare_parameter("gain", 0.5), 2.0);  // an int is accepted for a double
  EXPECT_EQ(node.declare_parameter("other", std::int64_t{0}), 7);
  EXPECT_EQ(node.declare_parameter("names", std::vector<std::string>{}),
            (std::vector<std::string>{"a", "b"}));
  EXPECT_THROW(node.declare_parameter("gain", 1.0), std::logic_error);
  EXPECT_THROW(static_cast<void>(node.get_parameter<double>("gian")), std::logic_error);
  std::string changed;
  node.on_parameter_change([&](const std::string& name, const ParameterValue&) { changed = name; });
  EXPECT_TRUE(node.set_parameter("gain", 3.0));
  EXPECT_EQ(changed, "gain");
  EXPECT_EQ(node.get_parameter<double>("gain"), 3.0);
  static_cast<void>(node.create_publisher<Text>("chatter"));
  EXPECT_TRUE(std::ranges::any_of(context.bus().topics(),
                                  [](const TopicInfo& t) { return t.name == "/left/speech"; }));
  EXPECT_THROW(Node(context, "a name"), InputError);
}

TEST_F(ClientLibraryTest, ParameterOfWrongTypeIsRefused) {
  Context context(options({"-p", "gain:=much"}));
  Node node(context, "arm");
  EXPECT_THROW(node.declare_parameter("gain", 0.5), InputError);
}

TEST_F(ClientLibraryTest, SimTimeFollowsClock) {
  Context context(options({"-p", "use_sim_time:=true"}));
  Node node(context, "arm");
  EXPECT_EQ(node.now(), Time{});
  auto clock = node.create_publisher<rosgraph_msgs::msg::Clock>("/clock");
  int calls = 0;
  const auto timer = node.create_timer(1s, [&] { ++calls; });
  for (int tenths = 1; tenths <= 25; ++tenths) {
    rosgraph_msgs::msg::Clock message;
    message.clock = to_time_msg(Time(tenths * 100ms));
    clock.publish(message);
    context.spin_some();
  }
  EXPECT_EQ(node.now(), Time(2500ms));
  EXPECT_EQ(calls, 2);
  timer->cancel();
  EXPECT_TRUE(timer->is_canceled());
}

TEST_F(ClientLibraryTest, CallbackExceptionLeavesSpin) {
  Context context(options());
  Node node(context, "arm");
  auto out = node.create_publisher<Text>("/self");
  node.create_subscription<Text>("/self", [](const Text& text) { throw std::runtime_error(text.data); });
  out.publish({"thrown"});
  EXPECT_THROW(context.spin_for(1s), std::runtime_error);
  const auto timer = node.create_wall_timer(1ms, [] { throw std::out_of_range("due"); });
  EXPECT_THROW(context.spin_for(1min), std::out_of_range);
}

TEST_F(ClientLibraryTest, SpinInCallbackThrows) {
  Context context(options());
  Node node(context, "impatient");
  const auto client = node.create_client<SetBool>("nobody");
  const auto timer = node.create_wall_timer(1ms, [&] { static_cast<void>(client.call({true}, kTimeout)); });
  EXPECT_THROW(context.spin_for(kTimeout), std::logic_error);
  timer->cancel();
  EXPECT_NO_THROW(context.spin_some());
}

TEST_F(ClientLibraryTest, GoalCallbackExceptionLeavesSpinAndRejects) {
  Context context(options());
  Node node(context, "arm");
  const auto server = node.create_action_server<Follow>(
      "~/follow",
      {.on_goal = [](const GoalId&, const Follow::Goal&) -> Status { throw std::runtime_error("thrown"); },
       .on_cancel = {}});
  ActionClient<Follow> client(node, "~/follow");
  ASSERT_TRUE(client.wait_for_action_server(kTimeout));
  const auto goal = client.send_goal({});
  EXPECT_THROW(client.wait_for_result(*goal, kTimeout), std::runtime_error);
  EXPECT_TRUE(client.wait_for_result(*goal, kTimeout));
  EXPECT_TRUE(goal->is_rejected());
}

TEST_F(ClientLibraryTest, SpinEndsOnShutdown) {
  Context context(options());
  EXPECT_TRUE(context.ok());
  std::thread other([&] { context.shutdown(); });
  context.spin();
  other.join();
  EXPECT_FALSE(context.ok());

  ContextOptions catching = options();
  catching.catch_signals = true;
  Context second(catching);
  std::raise(SIGINT);
  second.spin();
  EXPECT_FALSE(second.ok());
}

TEST_F(ClientLibraryTest, LogIsPublishedOnRosout) {
  Peer log_source(options(), [](Context& context) {
    struct LogSource {
      explicit LogSource(Context& context) : node(context, "teller", "/lab") {
        timer = node.create_wall_timer(5ms, [this] { node.warn("mind the gap"); });
      }
      Node node;
      std::shared_ptr<Timer> timer;
    };
    return std::make_unique<LogSource>(context);
  });
  Context context(options());
  Node node(context, "reader");
  std::string received, file;
  node.create_subscription<rcl_interfaces::msg::Log>(
      "/rosout",
      [&](const auto& line) {
        received = line.name + ": " + line.msg;
        file = line.file;
      },
      Qos::rosout());
  EXPECT_TRUE(context.spin_until([&] { return received == "lab.teller: mind the gap"; }, kTimeout))
      << received;
  EXPECT_TRUE(file.ends_with("library_test.cpp")) << file;
}

}  // namespace
}  // namespace doppel::ros2
