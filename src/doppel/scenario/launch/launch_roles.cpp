#include "doppel/scenario/launch/detail/launch_roles.h"

#include <algorithm>
#include <array>

namespace doppel {
namespace {

struct Row {
  std::string_view package;     // a * at the end: every package that begins so; "": every package
  std::string_view executable;  // likewise
  LaunchRole role;
  std::string_view text;
};

using enum LaunchRole;

constexpr std::string_view kPage = "the page shows it";
constexpr std::string_view kDrive = "doppel teleop drives the robot, and so does the page";
constexpr std::string_view kMoveIt =
    "not here: doppel ik, doppel reach and the page plan for one arm; a move_group of another machine finds "
    "the twin on the network";
constexpr std::string_view kNavigation = "not here: start it beside doppel, it finds the twin's topics";
constexpr std::string_view kSimulator = "doppel is the simulator";

// The first row that fits counts.
constexpr std::array kRows = std::to_array<Row>({
    {"robot_state_publisher", "*", robot_state, "the robot"},
    {"joint_state_publisher*", "*", joint_sliders, "the page has the sliders"},
    {"controller_manager", "ros2_control_node", manager, "the controller manager"},
    {"controller_manager", "spawner*", spawner, "controllers"},
    {"controller_manager", "unspawner*", covered,
     "controllers are switched by the page and by doppel control"},
    {"controller_manager", "*", spawner, "controllers"},
    {"ros_gz_sim", "create*", spawn, "the robot in the world"},
    {"ros_ign_gazebo", "create*", spawn, "the robot in the world"},
    {"gazebo_ros", "spawn*", spawn, "the robot in the world"},
    {"gazebo", "spawn*", spawn, "the robot in the world"},
    {"gazebo", "*", simulator, kSimulator},
    {"ros_gz_sim", "*", simulator, kSimulator},
    {"ros_ign_gazebo", "*", simulator, kSimulator},
    {"gazebo_ros", "*", simulator, kSimulator},
    {"", "gzserver", simulator, kSimulator},
    {"", "gzclient", page, kPage},
    {"", "gazebo", simulator, kSimulator},
    {"", "gz", simulator, kSimulator},
    {"", "ign", simulator, kSimulator},
    {"ros_gz_bridge", "*", bridge, "doppel's topics have their ROS names"},
    {"ros_gz_image", "*", bridge, "doppel's cameras have their ROS names"},
    {"ros_ign_bridge", "*", bridge, "doppel's topics have their ROS names"},
    {"ros_ign_image", "*", bridge, "doppel's cameras have their ROS names"},
    {"rviz2", "*", page, kPage},
    {"rviz", "*", page, kPage},
    {"rqt*", "*", page, kPage},
    {"plotjuggler*", "*", page, "the page has curves"},
    {"foxglove_bridge", "*", covered, "doppel's server speaks Foxglove's protocol"},
    {"rosbridge_server", "*", absent, "not here: doppel's server speaks Foxglove's protocol instead"},
    {"tf2_ros", "static_transform_publisher", frame, "a fixed transform"},
    {"tf", "static_transform_publisher", frame, "a fixed transform"},
    {"tf2_ros", "*", covered, "doppel tf"},
    {"teleop_twist_keyboard", "*", drive, kDrive},
    {"teleop_twist_joy", "*", drive, kDrive},
    {"joy*", "*", drive, kDrive},
    {"key_teleop", "*", drive, kDrive},
    {"topic_tools", "*", absent, "not here"},
    {"moveit*", "*", absent, kMoveIt},
    {"warehouse_ros*", "*", absent, kMoveIt},
    {"nav2_*", "*", absent, kNavigation},
    {"slam_toolbox", "*", absent, kNavigation},
    {"cartographer_ros", "*", absent, kNavigation},
    {"gmapping", "*", absent, kNavigation},
    {"amcl", "*", absent, kNavigation},
    {"map_server", "*", absent, kNavigation},
    {"move_base", "*", absent, kNavigation},
    {"robot_localization", "*", absent, "not here: the base publishes its odometry"},
    {"rosbag2*", "*", absent, "doppel bag record"},
    {"ros2bag", "*", absent, "doppel bag record"},
    {"rosbag", "*", absent, "doppel bag record"},
});

bool fits(std::string_view pattern, std::string_view name) {
  if (pattern.ends_with('*')) return name.starts_with(pattern.substr(0, pattern.size() - 1));
  return pattern == name;
}

bool fits_package(std::string_view pattern, std::string_view name) {
  return pattern.empty() ? name.empty() : fits(pattern, name);
}

bool has_word(std::string_view text, std::string_view word) {
  return text.find(word) != std::string_view::npos;
}

}  // namespace

LaunchMeaning launch_meaning(std::string_view package, std::string_view executable) {
  const auto* const row = std::find_if(kRows.begin(), kRows.end(), [&](const Row& one) {
    return fits_package(one.package, package) && fits(one.executable, executable);
  });
  return row == kRows.end() ? LaunchMeaning{} : LaunchMeaning{row->role, row->text};
}

LaunchMeaning include_meaning(std::string_view package, std::string_view file) {
  if (package == "ros_gz_sim" || package == "ros_ign_gazebo" || package == "gazebo_ros") {
    if (has_word(file, "spawn")) return {spawn, "the robot in the world"};
    if (has_word(file, "client")) return {page, kPage};
    return {simulator, kSimulator};
  }
  if (package == "ros_gz_bridge") return {bridge, "doppel's topics have their ROS names"};
  if (package.starts_with("moveit")) return {absent, kMoveIt};
  if (package.starts_with("nav2_") || package == "slam_toolbox" || package == "turtlebot3_navigation2" ||
      package == "turtlebot3_cartographer")
    return {absent, kNavigation};
  if (package == "rviz2") return {page, kPage};
  if (package == "teleop_twist_joy") return {drive, kDrive};
  return {};
}

}  // namespace doppel
