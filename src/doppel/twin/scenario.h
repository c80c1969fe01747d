#pragma once
// All that a run is, in one typed struct: the command line fills it, tests and programs fill it by hand.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/bus/ros_arguments.h"
#include "doppel/core/time.h"
#include "doppel/description/load.h"
#include "doppel/physics/engine_modules.h"
#include "doppel/physics/world_robot.h"

namespace doppel {

struct Scenario {
  std::vector<WorldRobot> robots;              // beside those that the world file names
  std::optional<std::filesystem::path> world;  // a world file; none: empty, with ground
  std::string engine = kDefaultEngine;
  bool start_controllers = true;     // false: nothing is loaded, the joints are passive
  std::vector<std::string> plugins;  // shared libraries with controllers and hardware
  bool ideal = false;                // joints follow commands exactly, whatever they carry
  bool enforce_limits = true;
  RosArguments ros;                      // names, parameters: what stood behind --ros-args
  bool wall_stamps = false;              // messages are stamped with wall-clock time, and there is no /clock
  std::filesystem::path bundled_robots;  // folder of the robots that ship with doppel
  // Looks at each expanded description whenever it is read, also at a reload: its findings are reported with
  // the rest.
  std::function<void(const ExpandedDescription&, Diagnostics&)> inspect;
};

}  // namespace doppel
