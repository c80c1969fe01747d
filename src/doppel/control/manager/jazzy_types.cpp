#include "doppel/control/manager/detail/jazzy_types.h"

#include <algorithm>
#include <array>

namespace doppel {

bool is_jazzy_type(std::string_view type) {
  // https://control.ros.org/jazzy/doc/ros2_controllers/doc/controllers_index.html
  static constexpr std::array<std::string_view, 27> kTypes{
      "ackermann_steering_controller/AckermannSteeringController",
      "admittance_controller/AdmittanceController",
      "battery_state_broadcaster/BatteryStateBroadcaster",
      "bicycle_steering_controller/BicycleSteeringController",
      "diff_drive_controller/DiffDriveController",
      "effort_controllers/GripperActionController",
      "effort_controllers/JointGroupEffortController",
      "force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster",
      "forward_command_controller/ForwardCommandController",
      "forward_command_controller/MultiInterfaceForwardCommandController",
      "gpio_controllers/GpioCommandController",
      "gps_sensor_broadcaster/GPSSensorBroadcaster",
      "imu_sensor_broadcaster/IMUSensorBroadcaster",
      "joint_state_broadcaster/JointStateBroadcaster",
      "joint_trajectory_controller/JointTrajectoryController",
      "magnetometer_broadcaster/MagnetometerBroadcaster",
      "mecanum_drive_controller/MecanumDriveController",
      "omni_wheel_drive_controller/OmniWheelDriveController",
      "parallel_gripper_action_controller/GripperActionController",
      "pid_controller/PidController",
      "pose_broadcaster/PoseBroadcaster",
      "position_controllers/GripperActionController",
      "position_controllers/JointGroupPositionController",
      "range_sensor_broadcaster/RangeSensorBroadcaster",
      "state_interfaces_broadcaster/StateInterfacesBroadcaster",
      "tricycle_controller/TricycleController",
      "tricycle_steering_controller/TricycleSteeringController"};
  return std::find(kTypes.begin(), kTypes.end(), type) != kTypes.end();
}

}  // namespace doppel
