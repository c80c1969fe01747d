// The contract of Controller::save() and restore(): a controller of every built-in type, restored to the
// middle of what it does, does the same again, bit by bit.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/bus/action_server.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {
namespace {

constexpr int kBefore = 43, kAfter = 260;  // ticks
using Says = std::function<void(ManagerRig&, int tick)>;

struct SavedCase {
  std::string type, parameters;
  std::vector<std::string> commands = {kPosition};
  std::vector<std::string> sensed = {};  // state interfaces of "s"
  Says say = [](ManagerRig&, int) {};    // at each tick
};

template <class M>
Says message(const std::string& topic, std::function<M(int)> make, int every) {
  return [topic, make = std::move(make), every](ManagerRig& rig, int tick) {
    if (tick % every == 0) rig.say<M>(topic, make(tick));
  };
}

// Commands that change, with pauses after which they time out.
Says twists(const std::string& topic) {
  return [topic](ManagerRig& rig, int tick) {
    if (tick % 7 != 0 || (tick % 120 > 60 && tick % 120 < 100)) return;
    geometry_msgs::msg::TwistStamped twist;
    twist.header.stamp = to_time_msg(rig.now);
    twist.twist.linear = {0.5 + 0.3 * std::sin(0.1 * tick), 0.2 * std::cos(0.07 * tick), 0};
    twist.twist.angular.z = 0.6 * std::sin(0.05 * tick);
    rig.say<geometry_msgs::msg::TwistStamped>(topic, twist);
  };
}

Says numbers_for(std::size_t count) {
  return message<std_msgs::msg::Float64MultiArray>(
      "/c/commands",
      [count](int tick) {
        std_msgs::msg::Float64MultiArray out;
        for (std::size_t i = 0; i < count; ++i)
          out.data.push_back(std::sin(0.3 * tick + static_cast<double>(i)));
        return out;
      },
      40);
}

trajectory_msgs::msg::JointTrajectory trajectory(int tick) {
  trajectory_msgs::msg::JointTrajectory out;
  out.joint_names = {"a", "b"};
  for (int i = 1; i <= 4; ++i) {
    auto& point = out.points.emplace_back();
    point.positions = {std::sin(0.9 * i + tick), 0.5 * std::cos(1.1 * i)};
    point.time_from_start = to_duration_msg(std::chrono::milliseconds(300 * i));
  }
  return out;
}

control_msgs::action::FollowJointTrajectory::Goal trajectory_goal(int tick) {
  control_msgs::action::FollowJointTrajectory::Goal goal;
  goal.trajectory = trajectory(tick);
  return goal;
}

// Through the action's service, as a client sends a goal.
template <Action A>
void send(ManagerRig& rig, const std::string& action, std::uint8_t id, const typename A::Goal& goal) {
  EXPECT_TRUE(rig.call<SendGoal<A>>(action + "/_action/send_goal", {{{id}}, goal}).accepted);
}
// The goals of one rig have different ids, also those that are sent again after a restore.
template <Action A>
void send_new(ManagerRig& rig, const std::string& action, const typename A::Goal& goal) {
  static std::uint8_t last = 0;
  send<A>(rig, action, ++last, goal);
}

Says trajectories() {
  return [](ManagerRig& rig, int tick) {
    if (tick == 20)
      send_new<control_msgs::action::FollowJointTrajectory>(rig, "/c/follow_joint_trajectory",
                                                            trajectory_goal(tick));
    if (tick == 200) rig.say("/c/joint_trajectory", trajectory(tick));
  };
}

template <class Goal>
Goal gripper_goal(double position) {
  Goal goal;
  if constexpr (requires { goal.command.max_effort; }) {
    goal.command.position = position;
    goal.command.max_effort = 4;
  } else {
    goal.command.name = {"a"};
    goal.command.position = {position};
  }
  return goal;
}

template <Action A>
Says grips() {
  return [](ManagerRig& rig, int tick) {
    if (tick == 35) send_new<A>(rig, "/c/gripper_cmd", gripper_goal<typename A::Goal>(0.9));
    if (tick == 170) send_new<A>(rig, "/c/gripper_cmd", gripper_goal<typename A::Goal>(-0.4));
  };
}

Says references() {
  return message<control_msgs::msg::MultiDOFCommand>(
      "/c/reference",
      [](int tick) {
        return control_msgs::msg::MultiDOFCommand{
            {"a", "b"}, {std::sin(0.2 * tick), 0.3 * std::cos(0.1 * tick)}, {}};
      },
      30);
}

std::vector<std::string> xyz(const std::string& field) {
  return {field + ".x", field + ".y", field + ".z"};
}

std::vector<std::string> all_names(std::initializer_list<std::vector<std::string>> lists) {
  std::vector<std::string> out;
  for (const auto& list : lists) out.insert(out.end(), list.begin(), list.end());
  return out;
}

std::vector<SavedCase> commander_cases() {
  using control_msgs::action::GripperCommand;
  using control_msgs::action::ParallelGripperCommand;
  const std::string joints = "joints: [a, b]", timeout = ", command_timeout: 0.2";
  const std::string pid = "{p: 3.0, i: 2.0, d: 0.1, i_clamp_max: 5.0, i_clamp_min: -5.0}";
  return {
      {"joint_trajectory_controller/JointTrajectoryController",
       joints + ", command_interfaces: [position], state_interfaces: [position, velocity]",
       {kPosition},
       {},
       trajectories()},
      {"joint_trajectory_controller/JointTrajectoryController",
       joints + ", command_interfaces: [effort], state_interfaces: [position, velocity], gains: {a: " + pid +
           ", b: " + pid + "}, constraints: {goal_time: 0.5}, cmd_timeout: 0.8",
       {kEffort},
       {},
       trajectories()},
      {"forward_command_controller/ForwardCommandController",
       joints + ", interface_name: velocity" + timeout,
       {kVelocity},
       {},
       numbers_for(2)},
      {"forward_command_controller/MultiInterfaceForwardCommandController",
       "joint: a, interface_names: [position, velocity]" + timeout,
       {kPosition, kVelocity},
       {},
       numbers_for(2)},
      {"doppel/ScalarCommandController",
       joints + ", interface_name: velocity, initial_value: 0.3" + timeout,
       {kVelocity},
       {},
       numbers_for(2)},
      {"position_controllers/JointGroupPositionController", joints, {kPosition}, {}, numbers_for(2)},
      {"velocity_controllers/JointGroupVelocityController",
       joints + timeout,
       {kVelocity},
       {},
       numbers_for(2)},
      {"effort_controllers/JointGroupEffortController", joints + timeout, {kEffort}, {}, numbers_for(2)},
      {"pid_controller/PidController",
       "dof_names: [a, b], command_interface: effort, reference_and_state_interfaces: [position], gains: "
       "{a: " +
           pid + ", b: " + pid + "}",
       {kEffort},
       {},
       references()},
      {"position_controllers/GripperActionController", "joint: a", {kPosition}, {}, grips<GripperCommand>()},
      {"effort_controllers/GripperActionController",
       "joint: a, allow_stalling: true, stall_timeout: 0.3, gains: {a: {p: 2.0, i: 1.0, d: 0.1, i_clamp: "
       "3.0}}",
       {kEffort},
       {},
       grips<GripperCommand>()},
      {"parallel_gripper_action_controller/GripperActionController",
       "joint: a",
       {kPosition},
       {},
       grips<ParallelGripperCommand>()},
  };
}

std::vector<SavedCase> base_cases() {
  const std::string steering = "wheelbase: 1.0, reference_timeout: 0.3, traction_joints_names: ";
  return {
      {"diff_drive_controller/DiffDriveController",
       "left_wheel_names: [a], right_wheel_names: [b], wheel_separation: 0.5, wheel_radius: 0.1, "
       "cmd_vel_timeout: "
       "0.2, linear: {x: {max_acceleration: 1.0, max_jerk: 20.0}}, angular: {z: {max_acceleration: 1.5}}, "
       "publish_rate: 30.0, publish_limited_velocity: true",
       {kVelocity},
       {},
       twists("/c/cmd_vel")},
      {"mecanum_drive_controller/MecanumDriveController",
       "front_left_wheel_command_joint_name: a, front_right_wheel_command_joint_name: b, "
       "rear_right_wheel_command_joint_name: c1, rear_left_wheel_command_joint_name: d, reference_timeout: "
       "0.2, "
       "kinematics: {wheels_radius: 0.1, sum_of_robot_center_projection_on_X_Y_axis: 0.6}, linear: {x: "
       "{max_acceleration: 1.0}}",
       {kVelocity},
       {},
       twists("/c/reference")},
      {"omni_wheel_drive_controller/OmniWheelDriveController",
       "wheel_names: [a, b, c1], wheel_offset: 0.0, robot_radius: 0.3, wheel_radius: 0.1, cmd_vel_timeout: "
       "0.2",
       {kVelocity},
       {},
       twists("/c/cmd_vel")},
      {"bicycle_steering_controller/BicycleSteeringController",
       steering + "[a], steering_joints_names: [b], traction_wheel_radius: 0.2",
       {kVelocity, kPosition},
       {},
       twists("/c/reference")},
      {"tricycle_steering_controller/TricycleSteeringController",
       steering +
           "[a, b], steering_joints_names: [c1], traction_wheels_radius: 0.2, traction_track_width: 0.6",
       {kVelocity, kPosition},
       {},
       twists("/c/reference")},
      {"ackermann_steering_controller/AckermannSteeringController",
       steering +
           "[a, b], steering_joints_names: [c1, d], traction_wheels_radius: 0.2, traction_track_width: 0.6, "
           "reduce_wheel_speed_until_steering_reached: true",
       {kVelocity, kPosition},
       {},
       twists("/c/reference")},
      {"tricycle_controller/TricycleController",
       "traction_joint_name: a, steering_joint_name: b, wheelbase: 2.0, wheel_radius: 0.5, cmd_vel_timeout: "
       "200, "
       "traction: {max_acceleration: 2.0, max_jerk: 50.0}, steering: {max_velocity: 1.0, max_acceleration: "
       "8.0}",
       {kVelocity, kPosition},
       {},
       twists("/c/cmd_vel")},
  };
}

std::vector<SavedCase> broadcaster_cases() {
  const std::vector<std::string> rotation = {"orientation.x", "orientation.y", "orientation.z",
                                             "orientation.w"};
  const std::string of_s = "sensor_name: s, frame_id: f";
  return {
      {"joint_state_broadcaster/JointStateBroadcaster", "extra_joints: [e]"},
      {"imu_sensor_broadcaster/IMUSensorBroadcaster",
       of_s,
       {kPosition},
       all_names({rotation, xyz("angular_velocity"), xyz("linear_acceleration")})},
      {"force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster",
       of_s,
       {kPosition},
       all_names({xyz("force"), xyz("torque")})},
      {"range_sensor_broadcaster/RangeSensorBroadcaster", of_s, {kPosition}, {"range"}},
      {"gps_sensor_broadcaster/GPSSensorBroadcaster",
       of_s,
       {kPosition},
       {"status", "service", "latitude", "longitude", "altitude"}},
      {"magnetometer_broadcaster/MagnetometerBroadcaster", of_s, {kPosition}, xyz("magnetic_field")},
      {"pose_broadcaster/PoseBroadcaster",
       "pose_name: s, frame_id: f, tf: {publish_rate: 7.0}",
       {kPosition},
       all_names({xyz("position"), rotation})},
      {"battery_state_broadcaster/BatteryStateBroadcaster",
       "batteries: [s], s: {minimum_voltage: 10.0, maximum_voltage: 12.0}",
       {kPosition},
       {"battery_voltage"}},
      {"state_interfaces_broadcaster/StateInterfacesBroadcaster", "interfaces: [a/position, a/velocity]"},
  };
}

std::vector<SavedCase> saved_cases() {
  std::vector<SavedCase> out = commander_cases();
  for (const auto& more : {base_cases(), broadcaster_cases()})
    out.insert(out.end(), more.begin(), more.end());
  return out;
}

class SavingRig : public ManagerRig {
 public:
  explicit SavingRig(const SavedCase& one)
      : ManagerRig(controller_yaml("c", one.type, one.parameters), joints(), hardware_of(one)), case_(one) {
    start({"c"});
    listener_ = bus.attach("listener");
    for (const TopicInfo& topic : bus.topics()) {
      // The clients of goals that have ended since the save have their answers already.
      if (topic.name != "/rosout" && topic.name.find("/_action/") == std::string::npos)
        listener_->subscribe(topic.id);
    }
  }
  ~SavingRig() { listener_.reset(); }

  // Runs ticks; returns all bits of commands, states and messages.
  std::vector<std::uint64_t> trace(int first, int last) {
    std::vector<std::uint64_t> out;
    take_messages();
    for (int tick = first; tick < last; ++tick) {
      case_.say(*this, tick);
      run(1);
      for (const auto& command : manager->command_interfaces())
        out.push_back(std::bit_cast<std::uint64_t>(manager->command(command.full_name)));
      for (const auto& state : manager->state_interfaces())
        out.push_back(std::bit_cast<std::uint64_t>(manager->state(state.full_name)));
      for (const std::uint64_t bits : take_messages()) out.push_back(bits);
    }
    return out;
  }

 private:
  static std::vector<FakeJoint> joints() {
    std::vector<FakeJoint> out;
    for (const char* name : {"a", "b", "c1", "d"}) out.push_back({name, JointType::continuous});
    return out;
  }
  static FakeHardwareOptions hardware_of(const SavedCase& one) {
    FakeHardwareOptions out;
    for (const FakeJoint& joint : joints()) out.joints.push_back(joint.name);
    out.commands = one.commands;
    out.time_constant = 0.15;
    double value = 0.5;
    for (const std::string& name : one.sensed) {
      value += 0.25;
      // A quaternion of unit length.
      out.more_states.push_back({"s", name, name.starts_with("orientation") ? 0.5 : value});
    }
    return out;
  }
  // The messages of the topics that controllers publish, as sums.
  std::vector<std::uint64_t> take_messages() {
    std::vector<std::uint64_t> out;
    Edge::Incoming incoming;
    while (listener_->next(incoming)) {
      out.push_back(incoming.topic);
      std::uint64_t sum = 0;
      for (const std::byte byte : incoming.cdr) sum = sum * 131 + static_cast<std::uint64_t>(byte);
      out.push_back(sum);
    }
    return out;
  }

  const SavedCase case_;
  std::unique_ptr<Edge> listener_;
};

class SavedController : public ::testing::TestWithParam<SavedCase> {};

TEST_P(SavedController, RestoredControllerActsEquallyAgain) {
  SavingRig rig(GetParam());
  rig.trace(0, kBefore);
  SavedSlot saved;
  ASSERT_TRUE(rig.manager->save(saved).ok());
  EXPECT_THAT(ControllerManager::unsaved_controllers(*saved), testing::IsEmpty());
  const Time then = rig.now;
  const auto first = rig.trace(kBefore, kAfter);
  ASSERT_THAT(rig.manager->differences(*saved), testing::IsEmpty());
  rig.bus.set_now(then);
  rig.manager->restore_switches(*saved, then);
  rig.manager->restore_values(*saved, then);
  rig.now = then;
  const auto second = rig.trace(kBefore, kAfter);
  EXPECT_EQ(first.size(), second.size());
  EXPECT_TRUE(first == second) << "the first difference is at "
                               << std::ranges::mismatch(first, second).in1 - first.begin() << " of "
                               << first.size();
}

INSTANTIATE_TEST_SUITE_P(AllTypes, SavedController, ::testing::ValuesIn(saved_cases()), [](const auto& one) {
  std::string name = one.param.type + "_" + std::to_string(one.index);
  std::ranges::replace_if(
      name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
});

TEST(SavedControllers, EveryBuiltInTypeIsCovered) {
  std::vector<std::string> covered;
  for (const SavedCase& one : saved_cases()) covered.push_back(one.type);
  for (const std::string& type : builtin_controllers().names()) EXPECT_THAT(covered, testing::Contains(type));
}

TEST(SavedControllers, GoalThatIsNewIsAbortedByRestore) {
  using control_msgs::action::FollowJointTrajectory;
  SavedCase one = commander_cases().front();
  one.say = [](ManagerRig&, int) {};
  SavingRig rig(one);
  rig.trace(0, 10);
  SavedSlot saved;
  ASSERT_TRUE(rig.manager->save(saved).ok());
  const Time then = rig.now;
  send<FollowJointTrajectory>(rig, "/c/follow_joint_trajectory", 1, trajectory_goal(0));
  rig.trace(10, 20);
  const auto edge = rig.bus.attach("client");
  std::optional<GetResult<FollowJointTrajectory>::Response> result;
  edge->call("/c/follow_joint_trajectory/_action/get_result",
             to_cdr(GetResult<FollowJointTrajectory>::Request{{GoalId{1}}}),
             [&](const Status&, const Bytes& cdr) { EXPECT_TRUE(from_cdr(cdr, result.emplace()).ok()); });
  rig.bus.spin();
  rig.manager->restore_values(*saved, then);
  rig.bus.spin();
  ASSERT_TRUE(result);
  EXPECT_EQ(static_cast<GoalStatus>(result->status), GoalStatus::aborted);
  EXPECT_EQ(result->result.error_code, FollowJointTrajectory::Result::INVALID_GOAL);
  EXPECT_EQ(result->result.error_string, restored_reason(then));
}

TEST(SavedControllers, ActiveSetOfSavedStateReturns) {
  SavingRig rig(commander_cases().front());
  rig.trace(0, kBefore);
  SavedSlot saved;
  ASSERT_TRUE(rig.manager->save(saved).ok());
  const Time then = rig.now;
  const auto first = rig.trace(kBefore, kAfter);
  ASSERT_TRUE(rig.switch_to({}, {"c"}).ok());
  rig.run(5);
  EXPECT_EQ(rig.state_of("c"), ControllerState::inactive);
  rig.bus.set_now(then);
  EXPECT_TRUE(rig.manager->restore_switches(*saved, then));
  rig.manager->restore_values(*saved, then);
  rig.now = then;
  EXPECT_EQ(rig.state_of("c"), ControllerState::active);
  EXPECT_TRUE(first == rig.trace(kBefore, kAfter));
}

TEST(SavedControllers, UnloadedControllerIsNamed) {
  SavingRig rig(commander_cases().front());
  SavedSlot saved;
  ASSERT_TRUE(rig.manager->save(saved).ok());
  ASSERT_TRUE(rig.switch_to({}, {"c"}).ok());
  ASSERT_TRUE(rig.manager->unload("c").ok());
  EXPECT_THAT(rig.manager->differences(*saved),
              testing::ElementsAre("the controller 'c', which was active, is not loaded"));
}

// A controller of someone else, which does not implement saving.
class Unsaving : public Controller {
 public:
  void on_init(ControllerContext& /*context*/) override {}
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override {
    return {InterfaceConfiguration::Kind::individual, {"a/position"}};
  }
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override { return {}; }
  Status on_activate() override {
    ++activations;
    return {};
  }
  void update(Time /*now*/, Duration /*period*/) override { command_handles[0].set(0.5); }
  static inline int activations = 0;
};

TEST(SavedControllers, ControllerWithoutSavingIsNamedAndReactivatedByRestore) {
  ManagerRig rig(controller_yaml("mine", "test/Unsaving", ""));
  rig.registry.add("test/Unsaving", [] { return std::make_unique<Unsaving>(); });
  rig.start({"mine"});
  rig.run(5);
  SavedSlot saved;
  ASSERT_TRUE(rig.manager->save(saved).ok());
  EXPECT_THAT(ControllerManager::unsaved_controllers(*saved), testing::ElementsAre("mine"));
  const int before = Unsaving::activations;
  rig.manager->restore_switches(*saved, rig.now);
  rig.manager->restore_values(*saved, rig.now);
  rig.manager->restart_unsaved(*saved, rig.now);
  EXPECT_EQ(Unsaving::activations, before + 1);
  EXPECT_EQ(rig.state_of("mine"), ControllerState::active);
  rig.run(2);
  EXPECT_EQ(rig.hardware->last_command("a/position"), 0.5);
}

TEST(SavedControllers, EmergencyStopIsPartOfState) {
  SavingRig rig(commander_cases().front());
  rig.trace(0, kBefore);
  SavedSlot saved;
  ASSERT_TRUE(rig.manager->save(saved).ok());
  rig.manager->stop("a test");
  rig.manager->restore_switches(*saved, rig.now);
  rig.manager->restore_values(*saved, rig.now);
  EXPECT_FALSE(rig.manager->is_stopped());
  EXPECT_EQ(rig.state_of("c"), ControllerState::active);
}

}  // namespace
}  // namespace doppel
