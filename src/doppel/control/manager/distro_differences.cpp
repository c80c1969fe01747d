#include "doppel/control/manager/distro_differences.h"

#include <algorithm>
#include <limits>

namespace doppel {
namespace {

constexpr DistroRange kToJazzy{.last = Distro::jazzy}, kToKilted{.last = Distro::kilted};

constexpr std::string_view kForward =
                               "forward_command_controller/ForwardCommandController with an interface_name",
                           kGripper = "parallel_gripper_action_controller/GripperActionController";

constexpr ControllerTypeRow kTypes[] = {
    {"ackermann_steering_controller/AckermannSteeringController"},
    {"admittance_controller/AdmittanceController"},
    {"battery_state_broadcaster/BatteryStateBroadcaster"},
    {"bicycle_steering_controller/BicycleSteeringController"},
    {"chained_filter_controller/ChainedFilter"},
    {"diff_drive_controller/DiffDriveController"},
    {"effort_controllers/GripperActionController", kToJazzy, kGripper},
    {"effort_controllers/JointGroupEffortController", kToKilted, kForward},
    {"force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster"},
    {"forward_command_controller/ForwardCommandController"},
    {"forward_command_controller/MultiInterfaceForwardCommandController"},
    {"gpio_controllers/GpioCommandController"},
    {"gps_sensor_broadcaster/GPSSensorBroadcaster"},
    {"imu_sensor_broadcaster/IMUSensorBroadcaster"},
    {"joint_state_broadcaster/JointStateBroadcaster"},
    {"joint_trajectory_controller/JointTrajectoryController"},
    {"magnetometer_broadcaster/MagnetometerBroadcaster"},
    {"mecanum_drive_controller/MecanumDriveController"},
    {"motion_primitives_controllers/MotionPrimitivesForwardController"},
    {"omni_wheel_drive_controller/OmniWheelDriveController"},
    {kGripper},
    {"pid_controller/PidController"},
    {"pose_broadcaster/PoseBroadcaster"},
    {"position_controllers/GripperActionController", kToJazzy, kGripper},
    {"position_controllers/JointGroupPositionController", kToKilted, kForward},
    {"range_sensor_broadcaster/RangeSensorBroadcaster"},
    {"state_interfaces_broadcaster/StateInterfacesBroadcaster"},
    {"tricycle_controller/TricycleController"},
    {"tricycle_steering_controller/TricycleSteeringController"},
    {"velocity_controllers/JointGroupVelocityController", kToKilted, kForward}};

constexpr std::string_view kNan = ".NAN for the limits that do not apply", kRadius = "traction_wheels_radius",
                           kTracks = "traction_track_width or steering_track_width",
                           kNames = "traction_joints_names and steering_joints_names",
                           kStates = "traction_joints_state_names and steering_joints_state_names",
                           kAckermann = "ackermann_steering_controller",
                           kBicycle = "bicycle_steering_controller",
                           kTricycle = "tricycle_steering_controller";

constexpr ParameterRow kParameters[] = {
    {"joint_trajectory_controller", "open_loop_control", kToJazzy, "interpolate_from_desired_state"},
    {"joint_trajectory_controller", "gains.*.i_clamp", kToJazzy, "i_clamp_max and i_clamp_min"},
    {"joint_trajectory_controller", "gains.*.antiwindup_strategy", kToJazzy, "none", "legacy"},
    {"pid_controller", "gains.*.antiwindup_strategy", kToJazzy, "none", "legacy"},
    {"pid_controller", "enable_feedforward", kToJazzy, "feedforward_gain, 0 for none"},
    {"diff_drive_controller", "*.has_velocity_limits", kToJazzy, kNan},
    {"diff_drive_controller", "*.has_acceleration_limits", kToJazzy, kNan},
    {"diff_drive_controller", "*.has_jerk_limits", kToJazzy, kNan},
    {"diff_drive_controller", "*.min_acceleration", kToJazzy, "max_deceleration"},
    {"diff_drive_controller", "publish_rate", kToKilted, "the update_rate of the controller"},
    {"joint_state_broadcaster", "publish_dynamic_joint_states", kToKilted, "a state_interfaces_broadcaster"},
    {"pose_broadcaster", "tf.publish_rate", kToJazzy, "the update_rate of the controller"},
    {kAckermann, "front_wheel_track", kToJazzy, kTracks},
    {kAckermann, "rear_wheel_track", kToJazzy, kTracks},
    {kAckermann, "front_wheels_radius", kToJazzy, kRadius},
    {kAckermann, "rear_wheels_radius", kToJazzy, kRadius},
    {kBicycle, "front_wheel_radius", kToJazzy, "traction_wheel_radius"},
    {kBicycle, "rear_wheel_radius", kToJazzy, "traction_wheel_radius"},
    {kTricycle, "wheel_track", kToJazzy, "traction_track_width"},
    {kTricycle, "front_wheels_radius", kToJazzy, kRadius},
    {kTricycle, "rear_wheels_radius", kToJazzy, kRadius},
    {"*_steering_controller",
     "tf_frame_prefix",
     {.first = Distro::lyrical},
     "odom_frame_id and base_frame_id with the prefix"},
    {"*_steering_controller", "front_steering", kToJazzy, kNames},
    {"*_steering_controller", "rear_wheels_names", kToJazzy, kNames},
    {"*_steering_controller", "front_wheels_names", kToJazzy, kNames},
    {"*_steering_controller", "rear_wheels_state_names", kToJazzy, kStates},
    {"*_steering_controller", "front_wheels_state_names", kToJazzy, kStates}};

struct DefaultRow {
  std::string_view package, parameter;
  Distro first;
  DistroDefault value;
};

constexpr std::string_view kNone = "none";
constexpr DefaultRow kDefaults[] = {
    {"controller_manager", "hardware_components_initial_state.shutdown_on_initial_state_failure",
     Distro::kilted, false},
    {"controller_manager", "defaults.switch_controller.strictness", Distro::lyrical,
     std::string_view("strict")},
    {"joint_trajectory_controller", "gains.*.antiwindup_strategy", Distro::kilted, kNone},
    {"pid_controller", "gains.*.antiwindup_strategy", Distro::kilted, kNone},
    {"joint_state_broadcaster", "publish_dynamic_joint_states", Distro::lyrical, false},
    {"diff_drive_controller", "publish_rate", Distro::lyrical, std::numeric_limits<double>::infinity()}};

// '*' stands for any text, at most once in a pattern.
bool fits(std::string_view pattern, std::string_view text) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == text;
  const std::string_view before = pattern.substr(0, star), behind = pattern.substr(star + 1);
  return text.size() >= before.size() + behind.size() && text.starts_with(before) && text.ends_with(behind);
}

template <class Row>
bool is_about(const Row& row, std::string_view controller_type, std::string_view parameter) {
  return fits(row.package, controller_type.substr(0, controller_type.find('/'))) &&
         fits(row.parameter, parameter);
}

const ParameterRow* missing(std::string_view controller_type, std::string_view parameter,
                            std::string_view value) {
  const auto found = std::ranges::find_if(kParameters, [&](const ParameterRow& row) {
    return row.value == value && !row.range.contains(ros_distro()) &&
           is_about(row, controller_type, parameter);
  });
  return found == std::end(kParameters) ? nullptr : &*found;
}

}  // namespace

std::span<const ControllerTypeRow> ros2_controller_types() {
  return kTypes;
}

const ControllerTypeRow* find_ros2_type(std::string_view type) {
  const auto found = std::ranges::find(kTypes, type, &ControllerTypeRow::type);
  return found == std::end(kTypes) ? nullptr : &*found;
}

const ParameterRow* missing_parameter(std::string_view controller_type, std::string_view parameter) {
  return missing(controller_type, parameter, "");
}

const ParameterRow* missing_value(std::string_view controller_type, std::string_view parameter,
                                  std::string_view value) {
  return value.empty() ? nullptr : missing(controller_type, parameter, value);
}

const DistroDefault* changed_default(std::string_view controller_type, std::string_view parameter) {
  const auto found = std::ranges::find_if(kDefaults, [&](const DefaultRow& row) {
    return ros_distro() >= row.first && is_about(row, controller_type, parameter);
  });
  return found == std::end(kDefaults) ? nullptr : &found->value;
}

}  // namespace doppel
