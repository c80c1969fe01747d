#include "doppel/control/controllers/builtin.h"

#include "doppel/control/controllers/detail/bases.h"
#include "doppel/control/controllers/detail/broadcasters.h"
#include "doppel/control/controllers/detail/commanders.h"
#include "doppel/control/controllers/detail/joint_trajectory_controller.h"
#include "doppel/control/hardware/hardware.h"

namespace doppel {
namespace {

void register_commanders(ControllerRegistry& registry) {
  const auto group = [](const char* interface) {
    return [interface] { return make_joint_group_controller(interface); };
  };
  registry.add("joint_trajectory_controller/JointTrajectoryController",
               [] { return std::make_unique<JointTrajectoryController>(); });
  registry.add("forward_command_controller/ForwardCommandController", make_forward_command_controller);
  registry.add("forward_command_controller/MultiInterfaceForwardCommandController",
               make_multi_interface_forward_command_controller);
  registry.add("doppel/ScalarCommandController", make_scalar_command_controller);
  registry.add("position_controllers/JointGroupPositionController", group(kPosition));
  registry.add("velocity_controllers/JointGroupVelocityController", group(kVelocity));
  registry.add("effort_controllers/JointGroupEffortController", group(kEffort));
}

void register_bases(ControllerRegistry& registry) {
  const auto steering = [](SteeringKind kind) { return [kind] { return make_steering_controller(kind); }; };
  registry.add("diff_drive_controller/DiffDriveController", make_diff_drive_controller);
  registry.add("mecanum_drive_controller/MecanumDriveController", make_mecanum_drive_controller);
  registry.add("omni_wheel_drive_controller/OmniWheelDriveController", make_omni_wheel_drive_controller);
  registry.add("bicycle_steering_controller/BicycleSteeringController", steering(SteeringKind::bicycle));
  registry.add("tricycle_steering_controller/TricycleSteeringController", steering(SteeringKind::tricycle));
  registry.add("ackermann_steering_controller/AckermannSteeringController",
               steering(SteeringKind::ackermann));
  registry.add("tricycle_controller/TricycleController", make_tricycle_controller);
}

void register_broadcasters(ControllerRegistry& registry) {
  registry.add("imu_sensor_broadcaster/IMUSensorBroadcaster", make_imu_broadcaster);
  registry.add("force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster", make_force_torque_broadcaster);
  registry.add("range_sensor_broadcaster/RangeSensorBroadcaster", make_range_broadcaster);
  registry.add("gps_sensor_broadcaster/GPSSensorBroadcaster", make_satellite_broadcaster);
  registry.add("magnetometer_broadcaster/MagnetometerBroadcaster", make_magnetometer_broadcaster);
  registry.add("pose_broadcaster/PoseBroadcaster", make_pose_broadcaster);
  registry.add("battery_state_broadcaster/BatteryStateBroadcaster", make_battery_state_broadcaster);
  registry.add("state_interfaces_broadcaster/StateInterfacesBroadcaster", make_state_interfaces_broadcaster);
}

}  // namespace

ControllerRegistry builtin_controllers() {
  ControllerRegistry registry;
  registry.add("joint_state_broadcaster/JointStateBroadcaster", make_joint_state_broadcaster);
  register_commanders(registry);
  register_bases(registry);
  registry.add("pid_controller/PidController", make_pid_controller);
  register_broadcasters(registry);
  const auto gripper = [](GripperKind kind) { return [kind] { return make_gripper_controller(kind); }; };
  registry.add("position_controllers/GripperActionController", gripper(GripperKind::position));
  registry.add("effort_controllers/GripperActionController", gripper(GripperKind::effort));
  registry.add("parallel_gripper_action_controller/GripperActionController", gripper(GripperKind::parallel));
  return registry;
}

}  // namespace doppel
