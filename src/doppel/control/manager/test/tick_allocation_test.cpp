// The loop neither allocates nor frees: every operator new and delete of this program is counted.

#include <gtest/gtest.h>

#include "doppel/base/core/test/heap_touches.h"
#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {
namespace {

constexpr const char* kAll = R"(
controller_manager:
  ros__parameters:
    states: {type: joint_state_broadcaster/JointStateBroadcaster}
    group: {type: position_controllers/JointGroupPositionController}
    pid: {type: pid_controller/PidController}
group: {ros__parameters: {joints: [a]}}
pid: {ros__parameters: {dof_names: [b], command_interface: effort, reference_and_state_interfaces: [position],
                        gains: {b: {p: 1.0, i: 1.0, d: 0.1}}}}
)";

TEST(ManagerTick, NeitherAllocatesNorFrees) {
  FakeHardwareOptions options;
  options.commands = {kPosition, kEffort};
  options.joints = {"a", "b"};
  ManagerRig rig(kAll, {{.name = "a", .upper = 1, .velocity = 0.1}, {.name = "b", .effort = 1}}, options);
  rig.start({"states", "group", "pid"});
  // With subscribers, so that messages are built and sent, and with commands beyond the limits.
  const auto edge = rig.bus.attach("listener");
  for (const TopicInfo& topic : rig.bus.topics()) edge->subscribe(topic.id);
  rig.run(2);
  rig.say<std_msgs::msg::Float64MultiArray>("/group/commands", {{}, {7.0}});
  rig.say<control_msgs::msg::MultiDOFCommand>("/pid/reference", {{}, {100.0}, {}});
  rig.run(2);

  test::HeapTouches touches;
  for (int i = 0; i < 500; ++i) {
    touches.run();
    rig.manager->tick(rig.now);
    touches.pause();
    rig.now += rig.manager->period();
  }
  EXPECT_EQ(touches.count(), 0U);
  EXPECT_GT(rig.manager->command("a/position"), 0.0);
  EXPECT_EQ(rig.manager->command("b/effort"), 1.0);
  Edge::Incoming message;
  EXPECT_TRUE(edge->next(message));
}

}  // namespace
}  // namespace doppel
