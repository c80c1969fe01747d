// An arm behind topics: `doppel up use_sim:=false` drives it over DDS, and a participant of Fast DDS moves it
// and publishes where it is, as the node of a microcontroller does.

#include <control_msgs.h>
#include <gtest/gtest.h>
#include <sensor_msgs.h>

#include <atomic>
#include <cmath>
#include <map>
#include <mutex>
#include <thread>

#include "fast_action_client.h"
#include "fast_peer.h"
#include "twin_process.h"

namespace doppel::ros2_testing {
namespace {

using sensor_msgs::msg::dds_::JointState_;

// At 100 Hz, each joint at 3 rad/s at most.
class Arm {
 public:
  Arm() : thread_([this] { run(); }) {}
  ~Arm() {
    ends_ = true;
    thread_.join();
  }
  void be_silent(bool silent) { silent_ = silent; }
  [[nodiscard]] double q(const std::string& joint) {
    const std::lock_guard lock(mutex_);
    return q_.at(joint);
  }
  [[nodiscard]] int commands() const { return commands_; }
  [[nodiscard]] double largest_step() const { return largest_step_; }

 private:
  void run() {
    FastPeer peer{own_domain()};
    auto commands = peer.subscribe<JointState_>("rt/desk/joint_commands");
    auto states = peer.advertise<JointState_>("rt/desk/joint_states", {.reliable = false});
    std::map<std::string, double> goal = q_;
    auto due = std::chrono::steady_clock::now();
    for (; !ends_; std::this_thread::sleep_until(due)) {
      due += std::chrono::milliseconds(10);
      while (auto message = commands.take()) {
        ++commands_;
        for (std::size_t i = 0; i < message->value.name_().size(); ++i) {
          double& one = goal.at(message->value.name_()[i]);
          largest_step_ = std::max(largest_step_.load(), std::abs(message->value.position_()[i] - one));
          one = message->value.position_()[i];
        }
      }
      JointState_ state;
      const std::lock_guard lock(mutex_);
      const auto now = std::chrono::system_clock::now().time_since_epoch();
      state.header_().stamp_().sec_() =
          static_cast<std::int32_t>(std::chrono::duration_cast<std::chrono::seconds>(now).count());
      state.header_().stamp_().nanosec_() =
          static_cast<std::uint32_t>((now % std::chrono::seconds(1)).count());
      for (auto& [name, q] : q_) {
        q += std::clamp(goal.at(name) - q, -0.03, 0.03);
        state.name_().push_back(name);
        state.position_().push_back(q);
      }
      if (!silent_) states.publish(state);
    }
  }

  std::mutex mutex_;
  std::map<std::string, double> q_{{"shoulder", 0.2}, {"elbow", -0.3}};
  std::atomic<int> commands_{0};
  std::atomic<double> largest_step_{0};
  std::atomic<bool> ends_{false}, silent_{false};
  std::thread thread_;
};

FollowJointTrajectory::Goal way(double shoulder, double elbow) {
  FollowJointTrajectory::Goal goal;
  goal.trajectory_().joint_names_() = {"shoulder", "elbow"};
  auto& point = goal.trajectory_().points_().emplace_back();
  point.positions_() = {shoulder, elbow};
  point.time_from_start_().sec_() = 1;
  return goal;
}

TEST(FastTopicArm, GoalMovesArmOverDdsAndSilenceStopsIt) {
  Arm arm;
  arm.be_silent(true);
  TwinProcess twin({"use_sim:=false"}, source_folder() / "tests/ros2/topic_arm.xacro");
  FastPeer peer{own_domain()};
  auto states = peer.subscribe<JointState_>("rt/joint_states");
  ASSERT_TRUE(eventually([&] {
    return twin.output().find("start with the first states") != std::string::npos;
  })) << twin.output();
  std::this_thread::sleep_for(std::chrono::seconds(1));
  EXPECT_EQ(arm.commands(), 0) << "nothing is published without states";

  arm.be_silent(false);
  ActionClient<FollowJointTrajectory> action{peer, "/joint_trajectory_controller/follow_joint_trajectory"};
  ASSERT_TRUE(action.wait_for_server()) << twin.output();
  EXPECT_NEAR(arm.q("shoulder"), 0.2, 1e-6) << "activation moves nothing";
  const Uuid id = new_id();
  ASSERT_TRUE(action.send(id, way(0.8, 0.5)).value().accepted_());
  const auto result = action.result(id);
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->status_(), kSucceeded) << result->result_().error_string_() << twin.output();
  EXPECT_TRUE(eventually([&] { return std::abs(arm.q("shoulder") - 0.8) < 0.01; }));
  EXPECT_NEAR(arm.q("elbow"), 0.5, 0.01);
  EXPECT_LE(arm.largest_step(), 0.3) << "in steps that its speed limit permits";
  EXPECT_TRUE(states.next([](const JointState_& message) {
    for (std::size_t i = 0; i < message.name_().size(); ++i)
      if (message.name_()[i] == "shoulder") return std::abs(message.position_()[i] - 0.8) < 0.01;
    return false;
  }));

  const Uuid stopped = new_id();
  ASSERT_TRUE(action.send(stopped, way(-1.0, -1.0)).value().accepted_());
  ASSERT_TRUE(eventually([&] { return arm.q("shoulder") < 0.7; })) << "expected it to be on its way";
  arm.be_silent(true);
  const auto aborted = action.result(stopped);
  ASSERT_TRUE(aborted.has_value());
  EXPECT_EQ(aborted->status_(), kAborted) << twin.output();
  const int commands = arm.commands();
  const double stopped_at = arm.q("shoulder");
  EXPECT_GT(stopped_at, -0.9) << "it has stopped on its way";
  arm.be_silent(false);
  std::this_thread::sleep_for(std::chrono::seconds(1));
  EXPECT_EQ(arm.commands(), commands) << "nothing is resumed";
  EXPECT_NEAR(arm.q("shoulder"), stopped_at, 0.05);
}

}  // namespace
}  // namespace doppel::ros2_testing
