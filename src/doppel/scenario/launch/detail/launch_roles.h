#pragma once
// The meaning of the programs that launch files start, by package and executable.

#include <string>
#include <string_view>

namespace doppel {

enum class LaunchRole {
  robot_state,    // publishes a robot's links, and has its description
  joint_sliders,  // sets joints by hand
  manager,        // ros2_control's node
  spawner,        // of controllers
  simulator,      // a server of Gazebo, or its window
  spawn,          // puts a model into a simulator
  page,           // shows something: RViz, rqt
  bridge,         // between Gazebo and ROS
  frame,          // a fixed transform
  drive,          // by hand: keys, joystick
  covered,        // done by doppel anyway
  absent,         // known, and not a part of doppel
  other,          // a node of the user, or one of a package that is not known here
};

struct LaunchMeaning {
  LaunchRole role = LaunchRole::other;
  std::string_view text;  // in a tree: what it becomes
};

// `package` may be empty (a command of PATH).
LaunchMeaning launch_meaning(std::string_view package, std::string_view executable);
// The meaning of a launch file of a package: Gazebo's, MoveIt's, Nav2's.
LaunchMeaning include_meaning(std::string_view package, std::string_view file);

}  // namespace doppel
