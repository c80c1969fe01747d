#pragma once
// ros-controls' control_msgs, as in Jazzy: states of controllers, and the actions that move
// arms and grippers.

#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/trajectory_msgs.h"

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

// 0: the default is kept; -1: no limit.
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

struct AdmittanceControllerState {
  std_msgs::msg::Float64MultiArray mass, damping, stiffness;
  geometry_msgs::msg::Quaternion rot_base_control;
  geometry_msgs::msg::TransformStamped ref_trans_base_ft;
  std_msgs::msg::Int8MultiArray selected_axes;
  std_msgs::msg::String ft_sensor_frame;
  geometry_msgs::msg::TransformStamped admittance_position;
  geometry_msgs::msg::TwistStamped admittance_acceleration, admittance_velocity;
  geometry_msgs::msg::WrenchStamped wrench_base;
  sensor_msgs::msg::JointState joint_state;
  DOPPEL_MESSAGE("control_msgs/msg/AdmittanceControllerState", mass, damping, stiffness, rot_base_control,
                 ref_trans_base_ft, selected_axes, ft_sensor_frame, admittance_position,
                 admittance_acceleration, admittance_velocity, wrench_base, joint_state)
};

struct BatteryStateArray {
  std::vector<sensor_msgs::msg::BatteryState> battery_states;
  DOPPEL_MESSAGE("control_msgs/msg/BatteryStateArray", battery_states)
};

struct DynamicInterfaceValues {
  std_msgs::msg::Header header;
  InterfaceValue states, commands;
  DOPPEL_MESSAGE("control_msgs/msg/DynamicInterfaceValues", header, states, commands)
};

struct Float64Values {
  std_msgs::msg::Header header;
  std::vector<double> values;
  DOPPEL_MESSAGE("control_msgs/msg/Float64Values", header, values)
};

struct JointControllerState {
  std_msgs::msg::Header header;
  double set_point = 0, process_value = 0, process_value_dot = 0, error = 0, time_step = 0, command = 0,
         p = 0, i = 0, d = 0, i_clamp = 0;
  bool antiwindup = false;
  DOPPEL_MESSAGE("control_msgs/msg/JointControllerState", header, set_point, process_value, process_value_dot,
                 error, time_step, command, p, i, d, i_clamp, antiwindup)
};

struct JointJog {
  std_msgs::msg::Header header;
  std::vector<std::string> joint_names;
  std::vector<double> displacements, velocities;
  double duration = 0;
  DOPPEL_MESSAGE("control_msgs/msg/JointJog", header, joint_names, displacements, velocities, duration)
};

struct Keys {
  std_msgs::msg::Header header;
  std::vector<std::string> keys;
  DOPPEL_MESSAGE("control_msgs/msg/Keys", header, keys)
};

struct MecanumDriveControllerState {
  std_msgs::msg::Header header;
  double front_left_wheel_velocity = 0, back_left_wheel_velocity = 0, back_right_wheel_velocity = 0,
         front_right_wheel_velocity = 0;
  geometry_msgs::msg::Twist reference_velocity;
  DOPPEL_MESSAGE("control_msgs/msg/MecanumDriveControllerState", header, front_left_wheel_velocity,
                 back_left_wheel_velocity, back_right_wheel_velocity, front_right_wheel_velocity,
                 reference_velocity)
};

struct MotionArgument {
  std::string name;
  double value = 0;
  DOPPEL_MESSAGE("control_msgs/msg/MotionArgument", name, value)
};

struct MotionPrimitive {
  static constexpr std::int8_t UNKNOWN = -1, LINEAR_JOINT = 0, LINEAR_CARTESIAN = 50, CIRCULAR_CARTESIAN = 51;
  std::int8_t type = -1;
  double blend_radius = 0;
  std::vector<MotionArgument> additional_arguments;
  std::vector<geometry_msgs::msg::PoseStamped> poses;
  std::vector<double> joint_positions;
  DOPPEL_MESSAGE("control_msgs/msg/MotionPrimitive", type, blend_radius, additional_arguments, poses,
                 joint_positions)
  DOPPEL_CONSTANTS(UNKNOWN, LINEAR_JOINT, LINEAR_CARTESIAN, CIRCULAR_CARTESIAN)
};

struct MotionPrimitiveSequence {
  std::vector<MotionPrimitive> motions;
  DOPPEL_MESSAGE("control_msgs/msg/MotionPrimitiveSequence", motions)
};

struct SteeringControllerStatus {
  std_msgs::msg::Header header;
  std::vector<double> traction_wheels_position, traction_wheels_velocity, steer_positions,
      linear_velocity_command, steering_angle_command;
  DOPPEL_MESSAGE("control_msgs/msg/SteeringControllerStatus", header, traction_wheels_position,
                 traction_wheels_velocity, steer_positions, linear_velocity_command, steering_angle_command)
};

struct VDA5050SafetyState {
  static constexpr std::string_view AUTO_ACK = "autoAck", MANUAL = "manual", REMOTE = "remote", NONE = "none";
  std::string e_stop;
  bool field_violation = false;
  DOPPEL_MESSAGE("control_msgs/msg/VDA5050SafetyState", e_stop, field_violation)
  DOPPEL_CONSTANTS(AUTO_ACK, MANUAL, REMOTE, NONE)
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

struct QueryCalibrationState {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("control_msgs/srv/QueryCalibrationState_Request")
  };
  struct Response {
    bool is_calibrated = false;
    DOPPEL_MESSAGE("control_msgs/srv/QueryCalibrationState_Response", is_calibrated)
  };
};

struct SetOdometry {
  struct Request {
    double x = 0, y = 0, z = 0, roll = 0, pitch = 0, yaw = 0;
    DOPPEL_MESSAGE("control_msgs/srv/SetOdometry_Request", x, y, z, roll, pitch, yaw)
  };
  struct Response {
    bool success = false;
    std::string message;
    DOPPEL_MESSAGE("control_msgs/srv/SetOdometry_Response", success, message)
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

struct ExecuteMotionPrimitiveSequence {
  struct Goal {
    msg::MotionPrimitiveSequence trajectory;
    DOPPEL_MESSAGE("control_msgs/action/ExecuteMotionPrimitiveSequence_Goal", trajectory)
  };
  struct Result {
    static constexpr std::int32_t SUCCESSFUL = 0, INVALID_GOAL = -1, OLD_HEADER_TIMESTAMP = -3;
    std::int32_t error_code = 0;
    std::string error_string;
    DOPPEL_MESSAGE("control_msgs/action/ExecuteMotionPrimitiveSequence_Result", error_code, error_string)
    DOPPEL_CONSTANTS(SUCCESSFUL, INVALID_GOAL, OLD_HEADER_TIMESTAMP)
  };
  struct Feedback {
    std::uint8_t current_primitive_index = 0;
    DOPPEL_MESSAGE("control_msgs/action/ExecuteMotionPrimitiveSequence_Feedback", current_primitive_index)
  };
};

struct JointTrajectory {
  struct Goal {
    trajectory_msgs::msg::JointTrajectory trajectory;
    DOPPEL_MESSAGE("control_msgs/action/JointTrajectory_Goal", trajectory)
  };
  struct Result {
    DOPPEL_EMPTY_MESSAGE("control_msgs/action/JointTrajectory_Result")
  };
  struct Feedback {
    DOPPEL_EMPTY_MESSAGE("control_msgs/action/JointTrajectory_Feedback")
  };
};

struct PointHead {
  struct Goal {
    geometry_msgs::msg::PointStamped target;
    geometry_msgs::msg::Vector3 pointing_axis;
    std::string pointing_frame;
    builtin_interfaces::msg::Duration min_duration;
    double max_velocity = 0;
    DOPPEL_MESSAGE("control_msgs/action/PointHead_Goal", target, pointing_axis, pointing_frame, min_duration,
                   max_velocity)
  };
  struct Result {
    DOPPEL_EMPTY_MESSAGE("control_msgs/action/PointHead_Result")
  };
  struct Feedback {
    double pointing_angle_error = 0;
    DOPPEL_MESSAGE("control_msgs/action/PointHead_Feedback", pointing_angle_error)
  };
};

struct SingleJointPosition {
  struct Goal {
    double position = 0;
    builtin_interfaces::msg::Duration min_duration;
    double max_velocity = 0;
    DOPPEL_MESSAGE("control_msgs/action/SingleJointPosition_Goal", position, min_duration, max_velocity)
  };
  struct Result {
    DOPPEL_EMPTY_MESSAGE("control_msgs/action/SingleJointPosition_Result")
  };
  struct Feedback {
    std_msgs::msg::Header header;
    double position = 0, velocity = 0, error = 0;
    DOPPEL_MESSAGE("control_msgs/action/SingleJointPosition_Feedback", header, position, velocity, error)
  };
};

}  // namespace doppel::control_msgs::action
