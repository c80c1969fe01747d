#pragma once
// ros-controls' control_msgs, as in Jazzy: states of controllers, and the actions that move arms and
// grippers.

#include "doppel/messages/sensor_msgs.h"
#include "doppel/messages/trajectory_msgs.h"

namespace doppel::control_msgs::msg {

struct InterfaceValue {
  std::vector<std::string> interface_names;
  std::vector<double> values;
  DOPPEL_MESSAGE("control_msgs/msg/InterfaceValue", interface_names, values)
};

struct DynamicJointState {
  std_msgs::msg::Header header;
  std::vector<std::string> joint_names;
  std::vector<InterfaceValue> interface_values;
  DOPPEL_MESSAGE("control_msgs/msg/DynamicJointState", header, joint_names, interface_values)
};

struct DynamicInterfaceGroupValues {
  std_msgs::msg::Header header;
  std::vector<std::string> interface_groups;
  std::vector<InterfaceValue> interface_values;
  DOPPEL_MESSAGE("control_msgs/msg/DynamicInterfaceGroupValues", header, interface_groups, interface_values)
};

struct GripperCommand {
  double position = 0, max_effort = 0;
  DOPPEL_MESSAGE("control_msgs/msg/GripperCommand", position, max_effort)
};

// 0: the default stands; -1: no limit.
struct JointTolerance {
  std::string name;
  double position = 0, velocity = 0, acceleration = 0;
  DOPPEL_MESSAGE("control_msgs/msg/JointTolerance", name, position, velocity, acceleration)
};

struct JointComponentTolerance {
  static constexpr std::uint16_t X_AXIS = 1, Y_AXIS = 2, Z_AXIS = 3, TRANSLATION = 4, ROTATION = 5;
  std::string joint_name;
  std::uint16_t component = 0;
  double position = 0, velocity = 0, acceleration = 0;
  DOPPEL_MESSAGE("control_msgs/msg/JointComponentTolerance", joint_name, component, position, velocity,
                 acceleration)
  DOPPEL_CONSTANTS(X_AXIS, Y_AXIS, Z_AXIS, TRANSLATION, ROTATION)
};

struct JointTrajectoryControllerState {
  std_msgs::msg::Header header;
  std::vector<std::string> joint_names;
  trajectory_msgs::msg::JointTrajectoryPoint reference, feedback, error, output;
  std::vector<std::string> multi_dof_joint_names;
  trajectory_msgs::msg::MultiDOFJointTrajectoryPoint multi_dof_reference, multi_dof_feedback, multi_dof_error,
      multi_dof_output;
  double speed_scaling_factor = 0;
  DOPPEL_MESSAGE("control_msgs/msg/JointTrajectoryControllerState", header, joint_names, reference, feedback,
                 error, output, multi_dof_joint_names, multi_dof_reference, multi_dof_feedback,
                 multi_dof_error, multi_dof_output, speed_scaling_factor)
};

struct SpeedScalingFactor {
  double factor = 0;
  DOPPEL_MESSAGE("control_msgs/msg/SpeedScalingFactor", factor)
};

struct PidState {
  std_msgs::msg::Header header;
  builtin_interfaces::msg::Duration timestep;
  double error = 0, error_dot = 0;
  double p_error = 0, i_error = 0, d_error = 0;
  double p_term = 0, i_term = 0, d_term = 0;
  double i_max = 0, i_min = 0;
  double output = 0;
  DOPPEL_MESSAGE("control_msgs/msg/PidState", header, timestep, error, error_dot, p_error, i_error, d_error,
                 p_term, i_term, d_term, i_max, i_min, output)
};

struct MultiDOFCommand {
  std::vector<std::string> dof_names;
  std::vector<double> values, values_dot;
  DOPPEL_MESSAGE("control_msgs/msg/MultiDOFCommand", dof_names, values, values_dot)
};

struct SingleDOFState {
  std::string name;
  double reference = 0, feedback = 0, feedback_dot = 0, error = 0, error_dot = 0, time_step = 0, output = 0;
  DOPPEL_MESSAGE("control_msgs/msg/SingleDOFState", name, reference, feedback, feedback_dot, error, error_dot,
                 time_step, output)
};

struct SingleDOFStateStamped {
  std_msgs::msg::Header header;
  SingleDOFState dof_state;
  DOPPEL_MESSAGE("control_msgs/msg/SingleDOFStateStamped", header, dof_state)
};

struct MultiDOFStateStamped {
  std_msgs::msg::Header header;
  std::vector<SingleDOFState> dof_states;
  DOPPEL_MESSAGE("control_msgs/msg/MultiDOFStateStamped", header, dof_states)
};

}  // namespace doppel::control_msgs::msg

namespace doppel::control_msgs::srv {

struct QueryTrajectoryState {
  struct Request {
    builtin_interfaces::msg::Time time;
    DOPPEL_MESSAGE("control_msgs/srv/QueryTrajectoryState_Request", time)
  };
  struct Response {
    bool success = false;
    std::string message;
    std::vector<std::string> name;
    std::vector<double> position, velocity, acceleration;
    DOPPEL_MESSAGE("control_msgs/srv/QueryTrajectoryState_Response", success, message, name, position,
                   velocity, acceleration)
  };
};

}  // namespace doppel::control_msgs::srv

namespace doppel::control_msgs::action {

struct FollowJointTrajectory {
  struct Goal {
    trajectory_msgs::msg::JointTrajectory trajectory;
    trajectory_msgs::msg::MultiDOFJointTrajectory multi_dof_trajectory;
    std::vector<msg::JointTolerance> path_tolerance;
    std::vector<msg::JointComponentTolerance> component_path_tolerance;
    std::vector<msg::JointTolerance> goal_tolerance;
    std::vector<msg::JointComponentTolerance> component_goal_tolerance;
    builtin_interfaces::msg::Duration goal_time_tolerance;
    DOPPEL_MESSAGE("control_msgs/action/FollowJointTrajectory_Goal", trajectory, multi_dof_trajectory,
                   path_tolerance, component_path_tolerance, goal_tolerance, component_goal_tolerance,
                   goal_time_tolerance)
  };
  struct Result {
    static constexpr std::int32_t SUCCESSFUL = 0, INVALID_GOAL = -1, INVALID_JOINTS = -2,
                                  OLD_HEADER_TIMESTAMP = -3, PATH_TOLERANCE_VIOLATED = -4,
                                  GOAL_TOLERANCE_VIOLATED = -5;
    std::int32_t error_code = 0;
    std::string error_string;
    DOPPEL_MESSAGE("control_msgs/action/FollowJointTrajectory_Result", error_code, error_string)
    DOPPEL_CONSTANTS(SUCCESSFUL, INVALID_GOAL, INVALID_JOINTS, OLD_HEADER_TIMESTAMP, PATH_TOLERANCE_VIOLATED,
                     GOAL_TOLERANCE_VIOLATED)
  };
  struct Feedback {
    std_msgs::msg::Header header;
    std::vector<std::string> joint_names;
    trajectory_msgs::msg::JointTrajectoryPoint desired, actual, error;
    std::vector<std::string> multi_dof_joint_names;
    trajectory_msgs::msg::MultiDOFJointTrajectoryPoint multi_dof_desired, multi_dof_actual, multi_dof_error;
    DOPPEL_MESSAGE("control_msgs/action/FollowJointTrajectory_Feedback", header, joint_names, desired, actual,
                   error, multi_dof_joint_names, multi_dof_desired, multi_dof_actual, multi_dof_error)
  };
};

struct GripperCommand {
  struct Goal {
    msg::GripperCommand command;
    DOPPEL_MESSAGE("control_msgs/action/GripperCommand_Goal", command)
  };
  struct Result {
    double position = 0, effort = 0;
    bool stalled = false, reached_goal = false;
    DOPPEL_MESSAGE("control_msgs/action/GripperCommand_Result", position, effort, stalled, reached_goal)
  };
  struct Feedback {
    double position = 0, effort = 0;
    bool stalled = false, reached_goal = false;
    DOPPEL_MESSAGE("control_msgs/action/GripperCommand_Feedback", position, effort, stalled, reached_goal)
  };
};

struct ParallelGripperCommand {
  struct Goal {
    sensor_msgs::msg::JointState command;
    DOPPEL_MESSAGE("control_msgs/action/ParallelGripperCommand_Goal", command)
  };
  struct Result {
    sensor_msgs::msg::JointState state;
    bool stalled = false, reached_goal = false;
    DOPPEL_MESSAGE("control_msgs/action/ParallelGripperCommand_Result", state, stalled, reached_goal)
  };
  struct Feedback {
    sensor_msgs::msg::JointState state;
    DOPPEL_MESSAGE("control_msgs/action/ParallelGripperCommand_Feedback", state)
  };
};

}  // namespace doppel::control_msgs::action
