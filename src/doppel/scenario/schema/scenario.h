#pragma once
// The complete input of a run: filled by the command line, by tests or by user programs.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/physics/contract/engine_modules.h"
#include "doppel/physics/contract/world_robot.h"
#include "doppel/ros/bus/ros_arguments.h"
#include "doppel/sensors/rigs/light_rig.h"

namespace doppel {

struct Scenario {
  std::vector<WorldRobot> robots;              // in addition to those of the world file
  std::optional<std::filesystem::path> world;  // a world file; none: empty, with ground
  std::string engine = kDefaultEngine;
  bool start_controllers = true;     // false: no controller is loaded, the joints are passive
  std::vector<std::string> plugins;  // shared libraries with controllers and hardware
  bool ideal = false;                // joints follow commands exactly, under any load
  bool enforce_limits = true;
  bool strict = false;       // what ROS 2 would not accept is refused (a Twist for a TwistStamped)
  RosArguments ros;          // names and parameters of --ros-args
  RigOptions sensors;        // the seed of noise, and whether the loop waits for samples
  bool wall_stamps = false;  // messages are stamped with wall-clock time, and there is no /clock
  std::filesystem::path bundled_robots;  // folder of the robots that ship with doppel
};

}  // namespace doppel
