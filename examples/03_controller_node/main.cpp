// The lab walkthrough's controller node, without ROS: prints the received joint states and, every five
// seconds, commands the positions of the parameter 'positions' to the arm's joints. See README.md.
#include <fmt/format.h>

#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/network/node.h"

using doppel::sensor_msgs::msg::JointState;
using doppel::std_msgs::msg::Float64MultiArray;
using namespace std::chrono_literals;

class ArmController {
 public:
  explicit ArmController(doppel::ros2::Context& context) : node_(context, "arm_controller_node") {
    topic_ = node_.declare_parameter<std::string>("command_topic", "/position_controller/commands",
                                                  "where a forward command controller listens");
    node_.declare_parameter("positions", std::vector{1.0, 1.0, 1.0, 1.0},
                            "one for each joint of the controller, rad");
    commands_ = node_.create_publisher<Float64MultiArray>(topic_);
    node_.create_subscription<JointState>("joint_states", [this](const JointState& state) { print(state); });
    timer_ = node_.create_wall_timer(5s, [this] { send(); });
  }

 private:
  // Ten times a second is enough for reading.
  void print(const JointState& state) {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_print_ < 100ms) return;
    last_print_ = now;
    std::string line = "joint states:";
    for (std::size_t i = 0; i < state.name.size() && i < state.position.size(); ++i)
      line += fmt::format("  {} {:+.3f}", state.name[i], state.position[i]);
    fmt::print("{}\n", line);
    std::fflush(stdout);
  }

  void send() {
    if (commands_.subscription_count() == 0) node_.warn(topic_ + " has no subscriber yet");
    Float64MultiArray command;
    command.data = node_.get_parameter<std::vector<double>>("positions");  // setting it moves the arm
    commands_.publish(command);
    node_.info(fmt::format("sent [{:.2f}]", fmt::join(command.data, ", ")));
  }

  doppel::ros2::Node node_;
  std::string topic_;
  doppel::ros2::Publisher<Float64MultiArray> commands_;
  std::shared_ptr<doppel::ros2::Timer> timer_;
  std::chrono::steady_clock::time_point last_print_{};
};

int main(int argc, char** argv) {
  try {
    doppel::ros2::Context context(argc, argv);
    const ArmController controller(context);
    context.spin();
  } catch (const doppel::InputError& wrong_use) {
    fmt::print(stderr, "{}\n", wrong_use.what());
    return 2;
  }
  return 0;
}
