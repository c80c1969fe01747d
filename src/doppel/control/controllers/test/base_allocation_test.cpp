// update() of a base's controller neither allocates nor frees: driving, at the end of the commands, and while an
// edge receives its messages.

#include <gtest/gtest.h>

#include "doppel/base/core/test/heap_touches.h"
#include "doppel/control/controllers/test/base_rig.h"

namespace doppel {
namespace {

struct BaseCase {
  const char *name, *type, *parameters;
  std::vector<std::string> velocities, positions;
};

std::vector<BaseCase> bases() {
  return {{"Differential",
           "diff_drive_controller/DiffDriveController",
           "left_wheel_names: [l], right_wheel_names: [r], wheel_separation: 0.4, wheel_radius: 0.1, "
           "publish_limited_velocity: true, linear: {x: {max_acceleration: 2.0, max_jerk: 5.0}}",
           {"l", "r"},
           {}},
          {"Mecanum",
           "mecanum_drive_controller/MecanumDriveController",
           "front_left_wheel_command_joint_name: fl, front_right_wheel_command_joint_name: fr, "
           "rear_right_wheel_command_joint_name: rr, rear_left_wheel_command_joint_name: rl, "
           "reference_timeout: 0.2, "
           "kinematics: {wheels_radius: 0.5, sum_of_robot_center_projection_on_X_Y_axis: 1.0}",
           {"fl", "fr", "rr", "rl"},
           {}},
          {"Omni",
           "omni_wheel_drive_controller/OmniWheelDriveController",
           "wheel_names: [a, b, c], wheel_offset: 0.0, robot_radius: 0.5, wheel_radius: 0.1, "
           "cmd_vel_timeout: 0.2",
           {"a", "b", "c"},
           {}},
          {"Tricycle",
           "tricycle_controller/TricycleController",
           "traction_joint_name: w, steering_joint_name: s, wheelbase: 1.0, wheel_radius: 0.1, "
           "cmd_vel_timeout: 200, "
           "publish_ackermann_command: true, enable_odom_tf: true",
           {"w"},
           {"s"}},
          {"Ackermann",
           "ackermann_steering_controller/AckermannSteeringController",
           "traction_joints_names: [r, l], steering_joints_names: [rs, ls], wheelbase: 2.0, "
           "traction_track_width: 1.0, "
           "traction_wheels_radius: 0.5, reference_timeout: 0.2",
           {"r", "l"},
           {"rs", "ls"}}};
}

class BaseAllocation : public testing::TestWithParam<BaseCase> {};

TEST_P(BaseAllocation, UpdateDoesNotAllocate) {
  const BaseCase& base = GetParam();
  BaseRig rig(base.type, base.parameters, base_hardware(base.velocities, base.positions));
  rig.ManagerRig::start({"base"});
  const auto edge = rig.bus.attach("listener");
  for (const TopicInfo& topic : rig.bus.topics()) edge->subscribe(topic.id);
  test::HeapTouches touches;
  for (int i = 0; i < 200; ++i) {
    rig.bus.set_now(rig.now);
    if (i < 100) rig.say(0.5, 0, 0.3);  // then the commands end
    rig.manager->housekeeping(rig.now);
    touches.run();
    rig.manager->tick(rig.now);
    touches.pause();
    rig.now += rig.manager->period();
  }
  EXPECT_EQ(touches.count(), 0U);
  EXPECT_EQ(rig.velocity(base.velocities[0]), 0.0);
  Edge::Incoming message;
  EXPECT_TRUE(edge->next(message));
}

INSTANTIATE_TEST_SUITE_P(All, BaseAllocation, testing::ValuesIn(bases()),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace doppel
