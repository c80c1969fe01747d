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
#include "doppel/kinematics/model.h"

namespace doppel {

struct Scenario {
  std::string target;        // bundled name, .urdf, .xacro, or folder of a package or workspace
  XacroArguments arguments;  // name := value, in order
  std::optional<std::filesystem::path> world;        // a world file; none: empty, with ground
  std::optional<std::filesystem::path> controllers;  // a YAML file in place of what the description names
  std::vector<std::string> activate;  // controllers to start; empty: all that the files declare
  bool start_controllers = true;      // false: nothing is loaded, the joints are limp
  std::vector<std::string> plugins;   // shared libraries with controllers and hardware
  std::optional<BaseKind> base;       // how a root link other than "world" stands; none: choose_base()
  bool ideal = false;                 // joints follow commands exactly, whatever they carry
  bool enforce_limits = true;
  RosArguments ros;                      // names, parameters: what stood behind --ros-args
  bool wall_stamps = false;              // messages are stamped with the wall's time, and there is no /clock
  std::filesystem::path bundled_robots;  // folder of the robots that ship with doppel
  // Looks at the expanded description whenever it is read, also anew: what it finds is said with the rest.
  std::function<void(const ExpandedDescription&, Diagnostics&)> inspect;
};

}  // namespace doppel
