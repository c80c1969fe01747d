#pragma once
// The options of `doppel teleop`, and the ROS 2 nodes that it starts: teleop_twist_keyboard, or joy_node and
// teleop_twist_joy_node. Their parameters can be read and set on the network while the verb runs.

#include <memory>
#include <string>
#include <string_view>

#include "app/verbs/shell.h"
#include "app/verbs/velocity_topic.h"
#include "doppel/ros/bus/ros_arguments.h"
#include "doppel/ros/network/context.h"
#include "doppel/ros/teleop/teleop_keys.h"

namespace doppel::app {

struct TeleopOptions {
  std::string topic, frame, type = "auto";
  KeySettings keys;
  double joint_speed = 0.5;
  std::string device, config;
  bool calibrate = false, no_ros = false;
  const RosArguments* ros = nullptr;  // --ros-args of the command line
};

// The context of the nodes. params_file: with less priority than --ros-args; "": none.
std::unique_ptr<ros2::Context> open_context(const TeleopOptions& options,
                                            const std::string& params_file = "");
// True if the node that drives publishes TwistStamped: by its parameter, where it is written, then by --type.
std::optional<bool> asked_stamped(const TeleopOptions& options, ParameterOverrides& written,
                                  const char* parameter);
// The topic by the verb's option, then by a remapping rule of the node's "cmd_vel", else the one that the base reads.
VelocityTopic open_velocity(Client& twin, const ros2::Node& node, const TeleopOptions& options,
                            std::optional<bool> stamped);
// Names that are written for the node and are none of its parameters.
void report_unused_parameters(const ParameterOverrides& written, ros2::Node& node);

// Sends zeros when it ends, also by Ctrl-C or an error, so that no base drives on.
class StopAtExit {
 public:
  explicit StopAtExit(VelocityPublisher& base) : base_(base) {}
  ~StopAtExit();
  StopAtExit(const StopAtExit&) = delete;
  StopAtExit& operator=(const StopAtExit&) = delete;

 private:
  VelocityPublisher& base_;
};

int teleop_keyboard(Shell& shell, const TeleopOptions& options);
int teleop_joy(Shell& shell, const TeleopOptions& options);

}  // namespace doppel::app
