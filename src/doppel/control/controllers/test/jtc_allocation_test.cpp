// update() neither allocates nor frees: not while it follows a trajectory, and not when one starts, ends, is
// violated or brakes.

#include <gtest/gtest.h>

#include "doppel/base/core/test/heap_touches.h"
#include "doppel/control/controllers/test/jtc_rig.h"

namespace doppel {
namespace {

// Heap operations in the ticks of this time; what runs between them is not counted.
std::size_t touches_in(JtcRig& rig, double seconds) {
  test::HeapTouches touches;
  for (double time = 0; time < seconds; time += 0.01) {
    rig.bus.set_now(rig.now);
    rig.bus.spin();
    rig.manager->housekeeping(rig.now);
    touches.run();
    rig.manager->tick(rig.now);
    touches.pause();
    rig.now += rig.manager->period();
  }
  return touches.count();
}

class JtcAllocation : public testing::TestWithParam<std::vector<std::string>> {};

TEST_P(JtcAllocation, UpdateDoesNotAllocate) {
  JtcOptions options;
  options.joints = {{.name = "a", .velocity = 9}, {.name = "b", .velocity = 9}, {.name = "c", .velocity = 9}};
  options.commands = GetParam();
  options.more =
      "allow_integration_in_goal_trajectories: true, gains: {a: {p: 3.0, i: 1.0}, b: {p: 3.0}, c: {p: 3.0}}, "
      "constraints: {decelerate_on_cancel: true, a: {max_deceleration_on_cancel: 3.0}, b: "
      "{max_deceleration_on_cancel: "
      "2.0, trajectory: 0.5}, c: {max_deceleration_on_cancel: 1.0}}";
  JtcRig rig(options);
  const auto edge = rig.bus.attach("listener");  // so that the state is built and sent
  for (const TopicInfo& topic : rig.bus.topics()) edge->subscribe(topic.id);
  rig.run(2);
  rig.say(trajectory(kJoints, {point(0.5, {1, 1, 1}, {1, 1, 1}), point(1, {0, 0, 0}, {0, 0, 0})}));
  EXPECT_EQ(touches_in(rig, 1.2), 0U) << "expected no heap operation with a trajectory from the topic";
  rig.send(trajectory(kJoints, {point(0.5, {1, 1, 1}), point(1, {0.5, 0.5, 0.5})}));
  EXPECT_EQ(touches_in(rig, 1.2), 0U) << "expected no heap operation from a goal's acceptance to its success";
  const auto goal = rig.send(trajectory(kJoints, {point(1, {}, {1, 1, 1}), point(1.5, {}, {0, 0, 0})}));
  EXPECT_EQ(touches_in(rig, 0.5), 0U) << "expected no heap operation with integrated points";
  rig.cancel(goal);
  EXPECT_EQ(touches_in(rig, 1.0), 0U) << "expected no heap operation while braking";
  rig.send(trajectory(kJoints, {point(0.5, {2, 2, 2})}));
  EXPECT_EQ(touches_in(rig, 0.1), 0U);
  rig.hardware->set_offset("b", 2);
  EXPECT_EQ(touches_in(rig, 0.5), 0U) << "expected no heap operation at a violated tolerance";
  Edge::Incoming message;
  EXPECT_TRUE(edge->next(message));
}

INSTANTIATE_TEST_SUITE_P(All, JtcAllocation,
                         testing::Values(std::vector<std::string>{kPosition},
                                         std::vector<std::string>{kPosition, kVelocity, kAcceleration},
                                         std::vector<std::string>{kVelocity},
                                         std::vector<std::string>{kEffort}));

}  // namespace
}  // namespace doppel
