#include "app/synonyms.h"

#include <algorithm>
#include <array>

namespace doppel::app {
namespace {

struct Synonym {
  const char* group;    // the verb that has the subverbs; "": the program
  const char* word;     // as typed
  const char* pointer;  // a command line, or a sentence where there is no such verb
};

constexpr std::array kSynonyms = std::to_array<Synonym>({
    // ros2 and its tools
    {"", "roslaunch", "doppel launch FILE"},
    {"", "run", "doppel up TARGET"},
    {"", "start", "doppel up TARGET"},
    {"", "sim", "doppel up TARGET"},
    {"", "simulate", "doppel up TARGET"},
    {"", "gazebo", "doppel up TARGET"},
    {"", "gz", "doppel up TARGET"},
    {"", "ign", "doppel up TARGET"},
    {"", "rviz", "doppel view TARGET"},
    {"", "rviz2", "doppel view TARGET"},
    {"", "viz", "doppel view TARGET"},
    {"", "show", "doppel view TARGET"},
    {"", "display", "doppel view TARGET"},
    {"", "joint_state_publisher_gui", "doppel view TARGET"},
    {"", "plotjuggler", "doppel view BAG draws the curves of a recording; those of a twin are in its page"},
    {"", "list", "doppel robots lists the robots, doppel topic list the topics"},
    {"", "ls", "doppel robots lists the robots, doppel topic list the topics"},
    {"", "echo", "doppel topic echo TOPIC"},
    {"", "pub", "doppel topic pub TOPIC TYPE VALUES"},
    {"", "hz", "doppel topic hz TOPIC"},
    {"", "topics", "doppel topic list"},
    {"", "nodes", "doppel node list"},
    {"", "services", "doppel service list"},
    {"", "params", "doppel param list"},
    {"", "rosservice", "doppel service call SERVICE"},
    {"", "rostopic", "doppel topic"},
    {"", "rosnode", "doppel node"},
    {"", "rosparam", "doppel param"},
    {"", "rosmsg", "doppel interface show TYPE"},
    {"", "msg", "doppel interface show TYPE"},
    {"", "srv", "doppel interface show TYPE"},
    {"", "lifecycle", "doppel control list_controllers"},
    {"", "component", "doppel control list_hardware_components"},
    {"", "pkg",
     "packages are found around the description; doppel check TARGET reports those that are missing"},
    {"", "doctor_report", "doppel doctor"},
    {"", "wtf", "doppel doctor"},
    {"", "record", "doppel bag record -a, or from the first step on: doppel up TARGET --record FOLDER"},
    {"", "play", "doppel bag play BAG"},
    {"", "replay", "doppel bag resimulate BAG runs it again, doppel bag play BAG publishes its messages"},
    {"", "daemon", "doppel needs no daemon"},
    {"", "view_frames", "doppel tf view_frames"},
    {"", "tf2_echo", "doppel tf echo PARENT CHILD"},
    {"", "tf_echo", "doppel tf echo PARENT CHILD"},
    {"", "tf2", "doppel tf"},
    {"", "frames", "doppel tf tree"},
    {"", "spawn_model", "doppel spawn TARGET"},
    {"", "spawn_entity", "doppel spawn TARGET"},
    {"", "create", "doppel spawn TARGET in a running twin, doppel new NAME for an arm of your own"},
    {"", "delete_model", "doppel delete NAME"},
    {"", "remove", "doppel delete NAME"},
    {"", "spawner", "doppel control load_controller --set-state active NAME"},
    {"", "controller", "doppel control"},
    {"", "controllers", "doppel control list_controllers"},
    {"", "list_controllers", "doppel control list_controllers"},
    {"", "check_urdf", "doppel check FILE"},
    {"", "urdf", "doppel check FILE"},
    {"", "lint", "doppel check FILE"},
    {"", "verify_urdf", "doppel check FILE"},
    {"", "test", "doppel check --rest FILE"},
    {"", "fix", "doppel check --fix FILE"},
    {"", "urdf_to_graphviz", "doppel tree FILE --pdf FILE.pdf"},
    {"", "urdf_to_graphiz", "doppel tree FILE --pdf FILE.pdf"},
    {"", "xacro2urdf", "doppel xacro FILE"},
    {"", "fmt", "doppel convert TARGET"},
    {"", "format", "doppel convert TARGET"},
    {"", "export", "doppel convert TARGET"},
    {"", "sdf", "doppel convert TARGET --to sdf"},
    {"", "mjcf", "doppel convert TARGET --to mjcf"},
    {"", "plan",
     "doppel plans no motions; doppel convert TARGET --to srdf writes what MoveIt needs, doppel move moves "
     "joints"},
    {"", "moveit", "doppel plans no motions; doppel convert TARGET --to srdf writes what MoveIt needs"},
    {"", "goto", "doppel move JOINT=POSITION"},
    {"", "joint", "doppel move JOINT=POSITION"},
    {"", "joints", "doppel topic echo /joint_states"},
    {"", "teleop_twist_keyboard", "doppel teleop keyboard"},
    {"", "joy", "doppel teleop joy"},
    {"", "estop", "doppel stop"},
    {"", "e-stop", "doppel stop"},
    {"", "halt", "doppel stop stops all motion; Ctrl-C in its terminal ends a twin"},
    {"", "kill", "doppel stop stops all motion; Ctrl-C in its terminal ends a twin"},
    {"", "down", "doppel stop stops all motion; Ctrl-C in its terminal ends a twin"},
    {"", "init", "doppel new NAME"},
    {"", "version", "doppel --version"},
    {"", "man-page", "doppel man"},
    {"topic", "record", "doppel bag record TOPIC"},
    {"topic", "view", "doppel topic echo TOPIC"},
    {"topic", "get", "doppel topic echo TOPIC --once"},
    {"bag", "view", "doppel view BAG"},
    {"bag", "show", "doppel view BAG"},
    {"bag", "open", "doppel view BAG"},
    {"tf", "tf2_echo", "doppel tf echo PARENT CHILD"},
    {"tf", "list", "doppel tf tree"},
    {"control", "list", "doppel control list_controllers"},
    {"control", "spawner", "doppel control load_controller --set-state active NAME"},
    {"control", "spawn", "doppel control load_controller --set-state active NAME"},
    {"control", "activate", "doppel control set_controller_state NAME active"},
    {"control", "deactivate", "doppel control set_controller_state NAME inactive"},
    {"action", "send", "doppel action send_goal ACTION TYPE GOAL"},
    {"param", "delete", "parameters of a twin are declared by its nodes and cannot be deleted"},
    {"node", "kill",
     "nodes of a twin end with it; doppel control unload_controller NAME removes a controller"},
});

struct Replacement {
  const char* ros1;  // package/Type
  const char* ros2;  // a sentence
};

// Types that ROS 2 does not have under the name with msg/ in the middle. Sources: the packages' migration
// notes, index.ros.org.
constexpr std::array kReplacements = std::to_array<Replacement>({
    {"pr2_controllers_msgs/Pr2GripperCommand",
     "use control_msgs/msg/GripperCommand on /CONTROLLER/command: {position: 0.08, max_effort: 100.0}"},
    {"pr2_controllers_msgs/Pr2GripperCommandAction",
     "use the action control_msgs/action/GripperCommand: /CONTROLLER/gripper_cmd"},
    {"pr2_controllers_msgs/JointTrajectoryAction",
     "use the action control_msgs/action/FollowJointTrajectory: /CONTROLLER/follow_joint_trajectory"},
    {"pr2_controllers_msgs/JointTrajectoryControllerState",
     "use control_msgs/msg/JointTrajectoryControllerState"},
    {"pr2_controllers_msgs/JointControllerState", "use control_msgs/msg/JointControllerState"},
    {"pr2_mechanism_msgs/ListControllers", "use controller_manager_msgs/srv/ListControllers"},
    {"pr2_mechanism_msgs/SwitchController", "use controller_manager_msgs/srv/SwitchController"},
    {"gazebo_msgs/SpawnModel", "use gazebo_msgs/srv/SpawnEntity: /spawn_entity, or doppel spawn"},
    {"gazebo_msgs/DeleteModel", "use gazebo_msgs/srv/DeleteEntity: /delete_entity, or doppel delete"},
    {"dynamic_reconfigure/Config", "use parameters: doppel param set NODE NAME VALUE"},
    {"dynamic_reconfigure/Reconfigure", "use parameters: doppel param set NODE NAME VALUE"},
    {"move_base_msgs/MoveBaseAction", "use the action nav2_msgs/action/NavigateToPose of Nav2"},
    {"actionlib_msgs/GoalID",
     "use the action's cancel_goal service; Ctrl-C in doppel action send_goal calls it"},
});

}  // namespace

std::string replacement_of_ros1_type(std::string_view type) {
  // The messages of an action are named after it: GripperAction, GripperActionGoal, GripperGoal.
  std::string action(type);
  for (const char* suffix : {"Goal", "Result", "Feedback"}) {
    if (!action.ends_with(suffix)) continue;
    action.resize(action.size() - std::string_view(suffix).size());
    if (!action.ends_with("Action")) action += "Action";
    break;
  }
  const auto found = std::ranges::find_if(
      kReplacements, [&](const Replacement& r) { return type == r.ros1 || action == r.ros1; });
  return found == kReplacements.end() ? "" : found->ros2;
}

std::string pointer_for(std::string_view group, std::string_view word) {
  const auto found = std::ranges::find_if(
      kSynonyms, [&](const Synonym& synonym) { return group == synonym.group && word == synonym.word; });
  return found == kSynonyms.end() ? "" : found->pointer;
}

}  // namespace doppel::app
