// Saved states of whole twins: what follows a restore is, bit by bit, what followed the save.
#include <gmock/gmock.h>

#include <bit>
#include <filesystem>
#include <fstream>
#include <map>

#include "doppel/ros/bus/action_server.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/twin/loop/saved_state.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

using testing::HasSubstr;

const std::vector<std::string> kBundled = {"omarm_one",     "omarm_zero", "lab_arm",
                                           "kate",          "turtle",     "ackermann_car",
                                           "rover_mecanum", "rover_skid", "desk_arm"};

class SavedStates : public TwinFixture {
 protected:
  struct Trace {
    std::vector<std::uint64_t> states;                           // bits of every joint, and the hashes
    std::map<std::string, std::vector<std::uint64_t>> messages;  // by topic: stamps and sums of the bytes
  };
  using Act = std::function<void(int step)>;

  static Scenario scenario_of(const std::string& target, const std::string& engine) {
    Scenario out;
    out.robots = {{.target = target}};
    out.engine = engine;
    out.sensors.lockstep = true;
    return out;
  }

  void listen_to_all() {
    for (const TopicInfo& topic : twin_->bus().topics()) edge_->subscribe(topic.id);
    twin_->between_steps();
  }

  // A command for every active controller, of which each is another one.
  void command_all(double size) {
    for (const auto& robot : twin_->robots()) {
      const std::string prefix = robot->name_space().empty() ? "/" : "/" + robot->name_space() + "/";
      for (const ControllerView& controller : robot->controller_manager().controllers())
        if (controller.state == ControllerState::active)
          command(prefix + controller.name, controller, *robot, size);
    }
  }
  void command(const std::string& node, const ControllerView& view, const TwinRobot& robot, double size) {
    if (view.type.find("JointTrajectory") != std::string::npos) {
      std::string names, positions;
      for (const std::string& interface : view.claimed) {
        const std::string name = interface.substr(0, interface.find_last_of('/'));
        const int index = robot.model().find_joint(name);
        if (index < 0 || names.find("'" + name + "'") != std::string::npos) continue;
        const ModelJoint& joint_of = robot.model().joints[static_cast<std::size_t>(index)];
        const double q = robot.instance().q()[static_cast<std::size_t>(joint_of.q)];
        names += (names.empty() ? "'" : ", '") + name + "'";
        positions += (positions.empty() ? "" : ", ") +
                     std::to_string(std::clamp(q + size, joint_of.lower + 0.01, joint_of.upper - 0.01));
      }
      publish(node + "/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
              "{joint_names: [" + names + "], points: [{positions: [" + positions +
                  "], time_from_start: {nanosec: 900000000}}]}");
    } else if (view.type.find("JointGroup") != std::string::npos) {
      std::string values;
      for (const std::string& interface : view.claimed)
        values +=
            (values.empty() ? "" : ", ") + std::to_string(robot.controller_manager().state(interface) + size);
      publish(node + "/commands", "std_msgs/msg/Float64MultiArray", "{data: [" + values + "]}");
    } else if (view.type.find("Gripper") != std::string::npos) {
      publish(node + "/command", "control_msgs/msg/GripperCommand",
              "{position: " + std::to_string(0.01 * size) + ", max_effort: 5.0}");
    } else if (view.type.find("_drive_controller/") != std::string::npos ||
               view.type.find("_steering") != std::string::npos) {
      const bool references =
          view.type.find("mecanum") != std::string::npos || view.type.find("_steering") != std::string::npos;
      publish(node + (references ? "/reference" : "/cmd_vel"), "geometry_msgs/msg/TwistStamped",
              "{twist: {linear: {x: " + std::to_string(size) + "}, angular: {z: " + std::to_string(-size) +
                  "}}}");
    }
  }

  void read_states(Trace& out) const {
    const auto add = [&out](std::span<const double> values) {
      for (const double value : values) out.states.push_back(std::bit_cast<std::uint64_t>(value));
    };
    for (int i = 0; i < static_cast<int>(twin_->engine().world().instances().size()); ++i) {
      const Instance instance = twin_->engine().instance(i);
      add(instance.q());
      add(instance.v());
      add(instance.drive_effort());
    }
    for (const auto& robot : twin_->robots()) out.states.push_back(robot->state_hash());
    out.states.push_back(twin_->state_hash());
    out.states.push_back(twin_->steps());
  }

  void read_messages(Trace& out) {
    std::map<TopicId, std::string> names;
    for (const TopicInfo& topic : twin_->bus().topics()) names[topic.id] = topic.name;
    Edge::Incoming incoming;
    while (edge_->next(incoming)) {
      const std::string& name = names[incoming.topic];
      // Topics that watch the twin begin anew: /doppel/..., contacts, diagnostics.
      if (name.find("/doppel") != std::string::npos || name.find("contacts") != std::string::npos ||
          name.find("diagnostics") != std::string::npos || name.find("rosout") != std::string::npos)
        continue;
      std::uint64_t sum = 0;
      for (const std::byte byte : incoming.cdr) sum = sum * 131 + static_cast<std::uint64_t>(byte);
      auto& list = out.messages[name];
      list.push_back(static_cast<std::uint64_t>(incoming.stamp.time_since_epoch().count()));
      list.push_back(sum);
    }
  }

  Trace trace(
      int steps, const Act& act = [](int) {}) {
    Trace discarded, out;
    read_messages(discarded);
    for (int i = 0; i < steps; ++i) {
      act(i);
      twin_->between_steps();
      twin_->step();
      read_states(out);
    }
    twin_->between_steps();
    read_messages(out);
    return out;
  }

  static void expect_equal(const Trace& a, const Trace& b) {
    EXPECT_EQ(a.states.size(), b.states.size());
    EXPECT_TRUE(a.states == b.states);
    for (const auto& [topic, messages] : a.messages) {
      const auto other = b.messages.find(topic);
      ASSERT_NE(other, b.messages.end()) << topic;
      EXPECT_EQ(messages.size(), other->second.size()) << topic;
      EXPECT_TRUE(messages == other->second) << topic;
    }
    EXPECT_EQ(a.messages.size(), b.messages.size());
  }

  // Saves here, runs, restores, and runs again with the same commands.
  void expect_same_again(
      int steps, const Act& act = [](int) {}) {
    const auto saved = twin_->save();
    const Trace first = trace(steps, act);
    const Status restored = twin_->restore(*saved);
    ASSERT_TRUE(restored.ok()) << restored.why();
    EXPECT_EQ(twin_->now(), saved->time());
    const Trace second = trace(steps, act);
    expect_equal(first, second);
  }
};

class SavedRobots : public SavedStates,
                    public ::testing::WithParamInterface<std::tuple<std::string, std::string>> {};

TEST_P(SavedRobots, RestoredRobotMovesEquallyAgain) {
  const auto& [target, engine] = GetParam();
  bring_up(scenario_of(target, engine));
  listen_to_all();
  run(0.4);
  command_all(0.25);
  run(0.1);  // in the middle of a trajectory, of driving
  const std::span<const double> v = twin_->robot().instance().v();
  EXPECT_GT(Eigen::Map<const Eigen::VectorXd>(v.data(), std::ssize(v)).cwiseAbs().maxCoeff(), 0.05)
      << "it moves";
  expect_same_again(700, [this](int step) {
    if (step == 200) command_all(-0.4);
  });
}

INSTANTIATE_TEST_SUITE_P(Bundled, SavedRobots,
                         ::testing::Combine(::testing::ValuesIn(kBundled),
                                            ::testing::Values("mujoco", "bullet")),
                         [](const auto& one) {
                           return std::get<0>(one.param) + "_" + std::get<1>(one.param);
                         });

TEST_F(SavedStates, SensorsOfWorldMeasureEquallyAgain) {
  Scenario scenario;
  scenario.world = DOPPEL_SOURCE_DIR "/worlds/sensors.sdf";
  scenario.sensors.lockstep = true;
  scenario.sensors.seed = 7;
  bring_up(scenario);
  listen_to_all();
  run(0.23);
  expect_same_again(400);
}

TEST_F(SavedStates, SeveralRobotsAndObjectsMoveEquallyAgain) {
  Scenario scenario;
  scenario.sensors.lockstep = true;
  for (int i = 0; i < 3; ++i) {
    WorldRobot& robot = scenario.robots.emplace_back();
    robot.target = i < 2 ? "omarm_one" : "kate";
    robot.name_space = "r" + std::to_string(i);
    robot.X_WR = make_pose({2.0 * i, 0, 0}, {0, 0, 0});
  }
  bring_up(scenario);
  listen_to_all();
  spawn_ball("ball", {1, 0, 0.4});
  run(0.3);
  command_all(0.3);
  run(0.2);
  expect_same_again(500);
}

TEST_F(SavedStates, ObjectsOfSavedWorldReturn) {
  bring_up("omarm_one");
  spawn_ball("before", {1, 0, 0.4});
  run(0.2);
  const auto saved = twin_->save();
  const Trace first = trace(300);
  twin_->engine().remove("before");
  spawn_ball("since", {0, 1, 0.4});
  run(0.1);
  ASSERT_TRUE(twin_->restore(*saved).ok());
  EXPECT_TRUE(twin_->engine().find("before").has_value());
  EXPECT_FALSE(twin_->engine().find("since").has_value());
  expect_equal(first, trace(300));
}

TEST_F(SavedStates, AttachedObjectMovesEquallyAgain) {
  bring_up("omarm_one");
  spawn_ball("ball", {0.4, 0, 0.3});
  run(0.2);
  const auto join = [this](const char* service) {
    const Instance ball = twin_->engine().find("ball").value();
    return call(service, "gazebo_ros_link_attacher/srv/Attach",
                "{model_name_1: omarm, link_name_1: '" + twin_->robot().model().links[4].name +
                    "', model_name_2: ball, link_name_2: '" + ball.model().links.back().name + "'}");
  };
  ASSERT_THAT(join("/attach"), HasSubstr("true"));
  command_all(0.3);
  run(0.2);
  const auto saved = twin_->save();
  const Trace first = trace(300);
  ASSERT_THAT(join("/detach"), HasSubstr("true"));
  run(0.1);
  ASSERT_TRUE(twin_->restore(*saved).ok());
  EXPECT_EQ(twin_->engine().attachments().size(), 1u);
  expect_equal(first, trace(300));
}

TEST_F(SavedStates, LoadsOfServicesActEquallyAgain) {
  bring_up("omarm_one");
  run(0.2);
  static_cast<void>(call("/gazebo/apply_joint_effort", "gazebo_msgs/srv/ApplyJointEffort",
                         "{joint_name: 'Revolute 2', effort: 1.5, duration: {nanosec: 300000000}}"));
  run(0.1);
  expect_same_again(500);
}

TEST_F(SavedStates, RestoreAfterResetReturnsToSavedTime) {
  bring_up("kate");
  command_all(0.4);
  run(0.3);
  const auto saved = twin_->save();
  const Trace first = trace(300);
  twin_->reset();
  run(0.1);
  ASSERT_TRUE(twin_->restore(*saved).ok());
  expect_equal(first, trace(300));
}

TEST_F(SavedStates, EmergencyStopAndSwitchesReturn) {
  bring_up("omarm_one");
  run(0.2);
  command_all(0.3);
  run(0.2);
  const auto saved = twin_->save();
  const Trace first = trace(400);
  twin_->robot().controller_manager().stop("a test");
  run(0.2);
  ASSERT_TRUE(twin_->restore(*saved).ok());
  EXPECT_FALSE(twin_->robot().controller_manager().is_stopped());
  expect_equal(first, trace(400));
}

TEST_F(SavedStates, RobotThatWasAddedOrRemovedIsNamedAndNothingChanges) {
  Scenario scenario;
  for (const char* name : {"left", "right"}) {
    WorldRobot& robot = scenario.robots.emplace_back();
    robot.target = "omarm_one";
    robot.name_space = name;
  }
  scenario.robots.back().X_WR = make_pose({2, 0, 0}, {0, 0, 0});
  bring_up(scenario);
  run(0.1);
  const auto saved = twin_->save();
  ASSERT_TRUE(twin_->remove_robot("right").ok());
  run(0.1);
  const Time before = twin_->now();
  const std::uint64_t hash = twin_->state_hash();
  const Status restored = twin_->restore(*saved);
  EXPECT_FALSE(restored.ok());
  EXPECT_THAT(restored.why(), HasSubstr("right"));
  EXPECT_THAT(restored.why(), HasSubstr("has been removed since"));
  EXPECT_EQ(twin_->now(), before);
  EXPECT_EQ(twin_->state_hash(), hash);
}

TEST_F(SavedStates, GoalThatIsActiveInBothIsContinuedAndSucceeds) {
  using control_msgs::action::FollowJointTrajectory;
  bring_up("omarm_one");
  run(0.6);
  FollowJointTrajectory::Goal goal;
  for (int i = 1; i <= 6; ++i) goal.trajectory.joint_names.push_back("Revolute " + std::to_string(i));
  auto& point = goal.trajectory.points.emplace_back();
  point.positions.assign(6, 1.5);
  point.time_from_start = to_duration_msg(std::chrono::milliseconds(1500));
  const std::string action = "/omarm_arm_controller/follow_joint_trajectory/_action/";
  edge_->call(action + "send_goal", to_cdr(SendGoal<FollowJointTrajectory>::Request{{GoalId{1}}, goal}),
              [](const Status&, const Bytes&) {});
  run(0.5);
  std::optional<GetResult<FollowJointTrajectory>::Response> result;
  edge_->call(action + "get_result", to_cdr(GetResult<FollowJointTrajectory>::Request{{GoalId{1}}}),
              [&](const Status&, const Bytes& cdr) { EXPECT_TRUE(from_cdr(cdr, result.emplace()).ok()); });
  const auto saved = twin_->save();
  run(0.4);
  ASSERT_TRUE(twin_->restore(*saved).ok());
  run(0.5);
  EXPECT_FALSE(result) << "it is not finished at this time";
  run(2.0);
  ASSERT_TRUE(result);
  EXPECT_EQ(static_cast<GoalStatus>(result->status), GoalStatus::succeeded);
  // Its client has its answer; a restore to the middle of it moves the arm the same way again.
  ASSERT_TRUE(twin_->restore(*saved).ok());
  const Trace again = trace(500);
  ASSERT_TRUE(twin_->restore(*saved).ok());
  expect_equal(again, trace(500));
}

TEST_F(SavedStates, ClockGoesBackForItsReaders) {
  bring_up("omarm_one");
  listen("/clock");
  run(0.2);
  const auto saved = twin_->save();
  run(0.5);
  static_cast<void>(received<rosgraph_msgs::msg::Clock>("/clock"));
  ASSERT_TRUE(twin_->restore(*saved).ok());
  const auto clocks = received<rosgraph_msgs::msg::Clock>("/clock");
  ASSERT_FALSE(clocks.empty());
  EXPECT_EQ(from_msg(clocks.back().clock), saved->time());
}

// -- sensors that controllers read, and real hardware

class SavedDescriptions : public SavedStates {
 protected:
  // An arm of one joint with this plugin, and an IMU with noise and a walking bias.
  void bring_up_arm(const std::string& plugin) {
    const std::filesystem::path folder = make_folder("doppel_saved_descriptions");
    std::string channels, states;
    for (const char* axis : {"x", "y", "z"}) {
      channels += std::string("<") + axis +
                  "><noise type='gaussian'><mean>0</mean><stddev>0.2</stddev><bias_stddev>0.1</bias_stddev>"
                  "<dynamic_bias_stddev>0.05</dynamic_bias_stddev>"
                  "<dynamic_bias_correlation_time>2</dynamic_bias_correlation_time></noise></" +
                  axis + ">";
      states += std::string("<state_interface name='angular_velocity.") + axis +
                "'/><state_interface name='linear_acceleration." + axis + "'/>";
    }
    for (const char* axis : {"x", "y", "z", "w"})
      states += std::string("<state_interface name='orientation.") + axis + "'/>";
    std::ofstream(folder / "arm.urdf")
        << "<robot name='arm'><link name='base'/><link name='disc'><inertial><mass value='1'/><inertia "
           "ixx='0.1' "
           "iyy='0.1' izz='0.1' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='j' "
           "type='revolute'><parent "
           "link='base'/><child link='disc'/><axis xyz='0 1 0'/><limit lower='-3' upper='3' effort='50' "
           "velocity='4'/><safety_controller soft_lower_limit='-0.4' soft_upper_limit='0.4' k_position='8' "
           "k_velocity='3'/></joint><gazebo reference='disc'><sensor name='imu' type='imu'><update_rate>200"
           "</update_rate><topic>imu/data</topic><imu><angular_velocity>"
        << channels
        << "</angular_velocity></imu></sensor></gazebo><ros2_control name='a' type='system'><hardware>"
        << "<plugin>" << plugin << "</plugin></hardware><joint name='j'><command_interface name='position'/>"
        << "<state_interface name='position'/><state_interface name='velocity'/></joint><sensor name='imu'>"
        << states << "</sensor></ros2_control></robot>";
    std::ofstream(folder / "arm.yaml") << R"(
controller_manager:
  ros__parameters:
    update_rate: 250
    arm: {type: joint_trajectory_controller/JointTrajectoryController}
    imu_broadcaster: {type: imu_sensor_broadcaster/IMUSensorBroadcaster, update_rate: 50}
arm: {ros__parameters: {joints: [j], command_interfaces: [position], state_interfaces: [position, velocity]}}
imu_broadcaster: {ros__parameters: {sensor_name: imu, frame_id: disc}}
)";
    Scenario scenario;
    scenario.robots = {{.target = (folder / "arm.urdf").string()}};
    scenario.robots[0].controllers = {folder / "arm.yaml"};
    scenario.sensors = {.seed = 5, .lockstep = true};
    bring_up(scenario);
  }
};

TEST_F(SavedDescriptions, NoiseOfSensorsContinuesBetweenTwoTicks) {
  bring_up_arm("gz_ros2_control/GazeboSimSystem");
  listen_to_all();
  run(0.3);
  command_all(0.5);
  run(0.1);
  for (int i = 0; i < 5; ++i) {
    SCOPED_TRACE(i);
    run(0.001);  // other places between two ticks, which are 4 ms apart
    expect_same_again(250);
  }
}

TEST_F(SavedDescriptions, SoftLimitsActEquallyAgain) {
  bring_up_arm("gz_ros2_control/GazeboSimSystem");
  listen_to_all();
  run(0.2);
  command_all(1.0);  // beyond the soft limit, which the command approaches ever more slowly
  run(0.4);
  expect_same_again(600);
  EXPECT_LT(twin_->robot().instance().q()[0], 0.401);
}

TEST_F(SavedDescriptions, RealHardwareIsRefusedWithReason) {
  bring_up_arm("doppel/Loopback");
  try {
    static_cast<void>(twin_->save());
    FAIL() << "it was saved";
  } catch (const InputError& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("'arm' drives real hardware"));
  }
  twin_->keep_states(true);
  run(0.1);
  EXPECT_THAT(twin_->rewind(Duration{}).why(), HasSubstr("'arm' drives real hardware"));
}

// -- after a reload

class SavedStatesReload : public SavedStates {
 protected:
  void bring_up_copy() {
    folder_ = make_folder("doppel_saved_states") / "omarm_one";  // alone: packages search their neighbours
    std::filesystem::copy(DOPPEL_SOURCE_DIR "/robots/omarm_one", folder_,
                          std::filesystem::copy_options::recursive);
    bring_up(folder_.string());
  }
  void edit(const std::string& file, const std::string& former, const std::string& fresh) {
    std::ifstream input(folder_ / file);
    std::string text{std::istreambuf_iterator<char>(input), {}};
    const std::size_t place = text.find(former);
    ASSERT_NE(place, std::string::npos) << former;
    std::ofstream(folder_ / file) << text.replace(place, former.size(), fresh);
    Diagnostics reported;
    twin_->replace(Twin::prepare(twin_->running(), reported));
  }
  [[nodiscard]] std::vector<double> positions() const {
    const auto q = twin_->robot().instance().q();
    return {q.begin(), q.end()};
  }
  std::filesystem::path folder_;
};

TEST_F(SavedStatesReload, StateOfEqualStructureContinuesWithNewParameters) {
  bring_up_copy();
  std::string logged;
  log_.add_sink([&logged](const LogLine& line) { logged += line.text + "\n"; });
  run(0.3);
  command_all(0.4);
  run(0.3);
  const auto saved = twin_->save();
  const std::vector<double> then = positions();
  run(1.0);
  edit("urdf/omarm.xacro", "velocity=\"5.2\"", "velocity=\"4.4\"");
  run(0.2);
  const Status restored = twin_->restore(*saved);
  ASSERT_TRUE(restored.ok()) << restored.why();
  EXPECT_THAT(positions(), testing::Pointwise(testing::DoubleNear(1e-4), then))
      << "mimics follow their leaders";
  EXPECT_EQ(twin_->now(), saved->time());
  EXPECT_THAT(logged, HasSubstr("continues with the present parameters"));
  run(0.5);
  EXPECT_THAT(positions(), testing::Not(testing::Pointwise(testing::DoubleNear(0.05), then)))
      << "the trajectory of then goes on";
}

TEST_F(SavedStatesReload, StateOfAnotherStructureIsRefusedWithWhatDiffers) {
  bring_up_copy();
  run(0.2);
  const auto saved = twin_->save();
  edit("urdf/omarm.xacro", "</robot>",
       "<link name=\"flag\"/><joint name=\"flag_joint\" type=\"fixed\"><parent link=\"" +
           twin_->robot().model().links[0].name + "\"/><child link=\"flag\"/></joint></robot>");
  const Time before = twin_->now();
  const Status restored = twin_->restore(*saved);
  EXPECT_FALSE(restored.ok());
  EXPECT_THAT(restored.why(), HasSubstr("'flag"));
  EXPECT_EQ(twin_->now(), before);
}

// -- by services

TEST_F(SavedStates, ServicesSaveListRestoreAndDeleteByName) {
  bring_up("omarm_one");
  run(0.25);
  const auto named = [](const std::string& name) { return "{name: " + name + "}"; };
  EXPECT_THAT(call("/doppel/save_state", "doppel_msgs/srv/SaveState", named("home")),
              HasSubstr("t = 0.250 s"));
  run(0.5);
  EXPECT_THAT(call("/doppel/list_states", "doppel_msgs/srv/ListStates", "{}"), HasSubstr("home"));
  EXPECT_THAT(call("/doppel/save_state", "doppel_msgs/srv/SaveState", named("\"a\\x07b\"")),
              HasSubstr("the name of a state is text in UTF-8 without control characters"));
  EXPECT_THAT(call("/doppel/restore_state", "doppel_msgs/srv/RestoreState", named("hom")),
              HasSubstr("did you mean 'home'?"));
  EXPECT_THAT(call("/doppel/restore_state", "doppel_msgs/srv/RestoreState", named("home")),
              HasSubstr("t = 0.750 s is followed by t = 0.250 s"));
  EXPECT_DOUBLE_EQ(to_seconds(twin_->now()), 0.25);
  EXPECT_THAT(call("/doppel/delete_state", "doppel_msgs/srv/DeleteState", named("home")), HasSubstr("true"));
  EXPECT_THAT(call("/doppel/restore_state", "doppel_msgs/srv/RestoreState", named("home")),
              HasSubstr("there is no saved state"));
}

TEST_F(SavedStates, StateOfServicesContinuesEqually) {
  bring_up(scenario_of("kate", "mujoco"));
  listen_to_all();
  run(0.2);
  command_all(0.3);
  run(0.2);
  const auto by_service = [this](const char* service, const char* type) {
    return call(service, type, "{name: driving}");
  };
  ASSERT_THAT(by_service("/doppel/save_state", "doppel_msgs/srv/SaveState"), HasSubstr("success: true"));
  const Trace first = trace(400);
  ASSERT_THAT(by_service("/doppel/restore_state", "doppel_msgs/srv/RestoreState"),
              HasSubstr("success: true"));
  expect_equal(first, trace(400));
}

TEST_F(SavedStates, RewindGoesToNewestStateThatIsOldEnough) {
  bring_up("omarm_one");
  twin_->keep_states(true);
  run(3.2);
  EXPECT_THAT(call("/doppel/rewind", "doppel_msgs/srv/Rewind", "{seconds: 1.5}"),
              HasSubstr("rewound by 1.700 s: t = 3.200 s is followed by t = 1.500 s"));
  EXPECT_DOUBLE_EQ(to_seconds(twin_->now()), 1.5);
  run(0.6);
  EXPECT_TRUE(twin_->rewind(from_seconds(1)).ok());
  EXPECT_DOUBLE_EQ(to_seconds(twin_->now()), 1.0);
  const Status too_far = twin_->rewind(from_seconds(10));
  EXPECT_THAT(too_far.why(), HasSubstr("the oldest automatic state is 1.000 s old"));
}

TEST_F(SavedStates, RewindReachesThirtySecondsBackAndNoFurther) {
  bring_up("turtle");
  twin_->keep_states(true);
  run(35);
  EXPECT_FALSE(twin_->rewind(from_seconds(31)).ok());
  EXPECT_TRUE(twin_->rewind(from_seconds(29.5)).ok());
}

TEST_F(SavedStates, RewoundPausedTwinContinuesAsBefore) {
  bring_up("kate");
  twin_->keep_states(true);
  command_all(0.3);
  run(1.0);
  ASSERT_DOUBLE_EQ(to_seconds(twin_->now()), 1.0);
  const Trace first = trace(400);
  twin_->time_control().paused = true;
  ASSERT_TRUE(twin_->rewind(from_seconds(0.4)).ok());
  EXPECT_DOUBLE_EQ(to_seconds(twin_->now()), 1.0);
  EXPECT_TRUE(twin_->time_control().paused) << "a pause is not part of the state";
  expect_equal(first, trace(400));
}

TEST_F(SavedStates, RewindLeadsAwayFromDivergence) {
  bring_up("omarm_one");
  twin_->keep_states(true);
  twin_->time_control().pauses_at_divergence = true;
  run(0.7);
  Instance robot = twin_->robot().instance();
  for (int i = 0; i < 2000 && !twin_->diverged(); ++i) {
    robot.apply_joint_effort(2, 1e30);
    twin_->between_steps();
    twin_->step();
  }
  ASSERT_TRUE(twin_->diverged());
  EXPECT_THROW(static_cast<void>(twin_->save()), InputError);
  EXPECT_TRUE(twin_->rewind(Duration{}).ok());
  twin_->between_steps();
  EXPECT_FALSE(twin_->diverged());
  run(0.1);
}

}  // namespace
}  // namespace doppel::test
