#include "doppel/control/controllers/builtin.h"

#include <string>

#include "doppel/control/controllers/detail/diff_drive_controller.h"
#include "doppel/control/controllers/detail/forward_command_controller.h"
#include "doppel/control/controllers/detail/gripper_controller.h"
#include "doppel/control/controllers/detail/joint_state_broadcaster.h"
#include "doppel/control/controllers/detail/joint_trajectory_controller.h"
#include "doppel/control/controllers/detail/mecanum_drive_controller.h"
#include "doppel/control/controllers/detail/omni_wheel_drive_controller.h"
#include "doppel/control/controllers/detail/pid_controller.h"
#include "doppel/control/controllers/detail/sensor_broadcasters.h"
#include "doppel/control/controllers/detail/state_broadcasters.h"
#include "doppel/control/controllers/detail/steering_controller.h"
#include "doppel/control/controllers/detail/tricycle_controller.h"

namespace doppel {
namespace {

template <class T, class... Arguments>
ControllerRegistry::Factory make(Arguments... arguments) {
  return [arguments...] { return std::make_unique<T>(arguments...); };
}

void register_broadcasters(ControllerRegistry& registry) {
  registry.add("imu_sensor_broadcaster/IMUSensorBroadcaster", make<ImuBroadcaster>());
  registry.add("force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster",
               make<ForceTorqueBroadcaster>());
  registry.add("range_sensor_broadcaster/RangeSensorBroadcaster", make<RangeBroadcaster>());
  registry.add("gps_sensor_broadcaster/GPSSensorBroadcaster", make<SatelliteBroadcaster>());
  registry.add("magnetometer_broadcaster/MagnetometerBroadcaster", make<MagnetometerBroadcaster>());
  registry.add("pose_broadcaster/PoseBroadcaster", make<PoseBroadcaster>());
  registry.add("battery_state_broadcaster/BatteryStateBroadcaster", make<BatteryStateBroadcaster>());
  registry.add("state_interfaces_broadcaster/StateInterfacesBroadcaster", make<StateInterfacesBroadcaster>());
}

}  // namespace

ControllerRegistry builtin_controllers() {
  ControllerRegistry registry;
  registry.add("joint_state_broadcaster/JointStateBroadcaster", make<JointStateBroadcaster>());
  registry.add("joint_trajectory_controller/JointTrajectoryController", make<JointTrajectoryController>());
  registry.add("forward_command_controller/ForwardCommandController", make<ForwardCommandController>());
  registry.add("forward_command_controller/MultiInterfaceForwardCommandController",
               make<MultiInterfaceForwardCommandController>());
  registry.add("doppel/ScalarCommandController", make<ScalarCommandController>());
  registry.add("position_controllers/JointGroupPositionController",
               make<JointGroupController>(std::string(kPosition)));
  registry.add("velocity_controllers/JointGroupVelocityController",
               make<JointGroupController>(std::string(kVelocity)));
  registry.add("effort_controllers/JointGroupEffortController",
               make<JointGroupController>(std::string(kEffort)));
  registry.add("diff_drive_controller/DiffDriveController", make<DiffDriveController>());
  registry.add("mecanum_drive_controller/MecanumDriveController", make<MecanumDriveController>());
  registry.add("omni_wheel_drive_controller/OmniWheelDriveController", make<OmniWheelDriveController>());
  registry.add("bicycle_steering_controller/BicycleSteeringController",
               make<SteeringController>(SteeringKind::bicycle));
  registry.add("tricycle_steering_controller/TricycleSteeringController",
               make<SteeringController>(SteeringKind::tricycle));
  registry.add("ackermann_steering_controller/AckermannSteeringController",
               make<SteeringController>(SteeringKind::ackermann));
  registry.add("tricycle_controller/TricycleController", make<TricycleController>());
  registry.add("pid_controller/PidController", make<PidController>());
  register_broadcasters(registry);
  using control_msgs::action::GripperCommand;
  using control_msgs::action::ParallelGripperCommand;
  using GripperKind = GripperController::Kind;
  registry.add("position_controllers/GripperActionController",
               make<GripperActionController<GripperCommand>>(GripperKind::position));
  registry.add("effort_controllers/GripperActionController",
               make<GripperActionController<GripperCommand>>(GripperKind::effort));
  registry.add("parallel_gripper_action_controller/GripperActionController",
               make<GripperActionController<ParallelGripperCommand>>(GripperKind::parallel));
  return registry;
}

}  // namespace doppel
