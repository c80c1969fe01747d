// The walkthroughs' sample commands in every engine, with controllers, limits and servos as with `up`.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>

#include "doppel/physics/contract/engine_modules.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

struct Command {
  const char *topic, *type, *yaml;
  double seconds;  // until the next one
};

struct Sample {
  const char* robot;
  std::vector<Command> commands;
};

void PrintTo(const Sample& sample, std::ostream* out) {
  *out << sample.robot;
}

constexpr const char* kTrajectory = "trajectory_msgs/msg/JointTrajectory";

const Sample kSamples[] = {
    {"omarm_one",
     {{"/omarm_arm_controller/joint_trajectory", kTrajectory,
       R"({joint_names: ["Revolute 1","Revolute 2","Revolute 3","Revolute 4","Revolute 5","Revolute 6"],
points: [{positions: [1.57, 1.2, 1.57, 1.57, 1.57, 1.57], time_from_start: {sec: 3}}]})",
       4.0}}},
    {"omarm_zero",
     {{"/joint_trajectory_controller/joint_trajectory", kTrajectory,
       R"({joint_names: ['Revolute 1', 'Revolute 2', 'Revolute 3', 'Revolute 4', 'Revolute 5', 'Revolute 6'],
points: [{positions: [1.57, -1.57, -1.57, -1.57, -1.57, 0.0], time_from_start: {sec: 3}}]})",
       10.0},
      {"/joint_trajectory_controller/joint_trajectory", kTrajectory,
       R"({joint_names: ['Revolute 1', 'Revolute 2', 'Revolute 3', 'Revolute 4', 'Revolute 5', 'Revolute 6'],
points: [{positions: [1.57, -1.0, -2.0, -1.57, -1.57, -0.3], time_from_start: {sec: 4}}]})",
       8.0}}},
    {"lab_arm",
     {{"/position_controller/commands", "std_msgs/msg/Float64MultiArray", "{data: [1, 1, 1, 1]}", 4.0}}},
};

class EngineTrajectoriesTest : public TwinFixture, public ::testing::WithParamInterface<Sample> {
 protected:
  // The messages of /joint_states from the start to the end.
  std::vector<sensor_msgs::msg::JointState> run_in(const std::string& engine) {
    Scenario scenario;
    scenario.robots = {{.target = GetParam().robot}};
    scenario.engine = engine;
    bring_up(scenario);
    listen("/joint_states");
    std::vector<sensor_msgs::msg::JointState> out;
    for (const Command& command : GetParam().commands) {
      publish(command.topic, command.type, command.yaml);
      for (double t = 0; t < command.seconds - 1e-9; t += 0.5) {
        run(0.5);
        for (auto& message : received<sensor_msgs::msg::JointState>("/joint_states"))
          out.push_back(std::move(message));
      }
    }
    EXPECT_EQ(edge_->dropped(), 0u);
    return out;
  }
};

TEST_P(EngineTrajectoriesTest, SampleTrajectoriesAgreeBetweenEngines) {
  for (const KnownEngine& engine : known_engines()) {
    if (!engine.available || engine.name == kDefaultEngine) continue;
    const auto reference = run_in(kDefaultEngine), other = run_in(engine.name);
    ASSERT_EQ(reference.size(), other.size());
    ASSERT_GT(reference.size(), 100u);
    double largest = 0, travel = 0;
    std::string where;
    for (std::size_t i = 0; i < reference.size(); ++i) {
      ASSERT_EQ(reference[i].header.stamp.sec, other[i].header.stamp.sec);
      ASSERT_EQ(reference[i].header.stamp.nanosec, other[i].header.stamp.nanosec);
      ASSERT_EQ(reference[i].name, other[i].name);
      for (std::size_t k = 0; k < reference[i].name.size(); ++k) {
        travel = std::max(travel, std::abs(reference[i].position[k] - reference.front().position[k]));
        const double difference = std::abs(reference[i].position[k] - other[i].position[k]);
        if (difference <= largest) continue;
        largest = difference;
        where = reference[i].name[k];
      }
    }
    std::printf("  %s in %s and %s: at most %.2g rad apart (%s), over %zu samples\n", GetParam().robot,
                kDefaultEngine, engine.name.c_str(), largest, where.c_str(), reference.size());
    EXPECT_LT(largest, 0.02) << where;
    EXPECT_GT(travel, 0.3) << "expected the joint to move";
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, EngineTrajectoriesTest, ::testing::ValuesIn(kSamples),
                         [](const auto& of) { return std::string(of.param.robot); });

}  // namespace
}  // namespace doppel::test
