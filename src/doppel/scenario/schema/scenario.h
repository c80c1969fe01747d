#pragma once
// The complete input of a run: filled by the command line, by tests or by user programs.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/devices/emulation/emulation_options.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine_modules.h"
#include "doppel/physics/contract/world_robot.h"
#include "doppel/robot/kinematics/link_masses.h"
#include "doppel/ros/bus/ros_arguments.h"
#include "doppel/ros/messages/distro.h"
#include "doppel/sensors/rigs/light_rig.h"

namespace doppel {

// All that would be guessed of a robot but its arguments, base and namespace.
struct RobotChoices {
  std::vector<std::filesystem::path> controllers = {};  // files; later ones have priority
  std::vector<std::string> parameters = {};  // YAML texts of controllers without a file, after the files
  std::vector<std::string> active = {}, inactive = {};  // controllers to start, to load only; no others
  bool generated_hardware = false;  // simulated interfaces of every joint that can be driven
  LinkMasses masses = {};           // of links without a mass
};

// Factors of a robot whose masses and friction are not exactly those of its description.
struct RobotFactors {
  double mass = 1;      // of every link, its inertia included
  double friction = 1;  // of every joint's Coulomb friction and damping
};

// The thing behind the plugins of <ros2_control> that drive devices.
enum class HardwareUse {
  simulated,  // the simulated robot, without devices
  emulated,   // the drivers, on emulated buses whose motors are the simulated robot's joints
  ports,      // no drivers: the emulated devices, each behind a pseudo-terminal for another program
  real,       // the drivers, on the devices of this machine
};

// The twin of a robot with real hardware. /tf shows the measured joints in any case.
enum class MirrorMode {
  shadow,    // its drives get the commands that the hardware gets
  follow,    // its joints are where the measured ones are
  off,       // its joints are without commands
  rehearse,  // as shadow; a trajectory is sent once it has passed in a copy of the twin
};

// A fixed transform between two frames, on /tf_static, as from tf2_ros' static_transform_publisher.
struct StaticTransform {
  std::string parent, child;
  Pose X_PC = Pose::Identity();
};

struct DOPPEL_API Scenario {
  std::vector<WorldRobot> robots;              // in addition to those of the world file
  std::optional<std::filesystem::path> world;  // a world file; none: empty, with ground
  // Nothing is guessed: the robots of the world file are not added to those above, which have a base and
  // choices.
  bool complete = false;
  std::map<std::string, RobotChoices>
      choices;                   // by namespace; of a robot without them, what is not given is guessed
  std::optional<Duration> step;  // of the physics; none: the world's, or what the controllers' rates need
  std::string engine = kDefaultEngine;
  bool start_controllers = true;     // false: no controller is loaded, the joints are passive
  std::vector<std::string> plugins;  // shared libraries with controllers and hardware
  HardwareUse hardware = HardwareUse::simulated;
  EmulationOptions emulation;  // of emulated hardware and of ports
  MirrorMode mirror = MirrorMode::shadow;
  bool ideal = false;  // joints follow commands exactly, under any load
  bool enforce_limits = true;
  bool guard = true;  // commands of real and emulated hardware that end in a self-collision are refused
  std::vector<StaticTransform> transforms;  // beside those of the robots
  RobotFactors factors;          // of all robots that are read from files; a scenario file does not have them
  bool strict = false;           // what ROS 2 would not accept is refused (a Twist for a TwistStamped)
  RosArguments ros;              // names and parameters of --ros-args
  std::optional<Distro> distro;  // of ROS 2: messages and defaults; none: the process's
  RigOptions sensors;            // the seed of noise, and whether the loop waits for samples
  bool wall_stamps = false;      // messages are stamped with wall-clock time, and there is no /clock
  std::filesystem::path bundled_robots;  // folder of the robots that ship with doppel

  // nullptr: none. A robot that was sent to a service, and a model of the world, have none.
  [[nodiscard]] const RobotChoices* choices_of(const WorldRobot& robot) const {
    const auto found = choices.find(robot.name_space);
    return found == choices.end() || robot.target.empty() ? nullptr : &found->second;
  }
};

}  // namespace doppel
