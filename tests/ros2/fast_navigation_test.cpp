// A navigator of Fast DDS drives Kate by TF and odometry to goals that `doppel topic pub` sends as RViz does.

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "fast_kate_test.h"
#include "pure_pursuit.h"

namespace doppel::ros2_testing {
namespace {

using nav_msgs::msg::dds_::Odometry_;

class FastNavigation : public FastKateTest {
 protected:
  void send_goal(const PlanarPose& goal) {
    const std::string pose = fmt::format(
        "{{header: {{frame_id: odom}}, pose: {{position: {{x: {}, y: {}}}, orientation: {{z: {}, w: {}}}}}}}",
        goal.x, goal.y, std::sin(goal.yaw / 2), std::cos(goal.yaw / 2));
    Process verb({doppel_program(), "--remote", "topic", "pub", "--once", "/goal_pose",
                  "geometry_msgs/msg/PoseStamped", pose},
                 twin().variables(), twin().folder() / "pub");
    EXPECT_EQ(verb.wait(), 0);
  }
  std::optional<PlanarPose> true_pose() {
    auto truth = peer.subscribe<Odometry_>("rt/ground_truth/odom");
    const auto message = truth.next();
    if (!message) return std::nullopt;
    return planar(message->pose_().pose_().position_(), message->pose_().pose_().orientation_());
  }
};

TEST_F(FastNavigation, GoalsAreReachedByOdometryAndInTruth) {
  PurePursuit navigator(peer, {});
  ASSERT_TRUE(eventually([&] { return navigator.is_connected() && (navigator.update(), navigator.pose()); }));
  const auto start = true_pose();
  ASSERT_TRUE(start.has_value());
  const PlanarPose from = *navigator.pose();  // odometry may have another origin than the world
  for (const PlanarPose& goal : {PlanarPose{1.0, 0.0, 0.0}, PlanarPose{1.0, 0.8, std::numbers::pi / 2},
                                 PlanarPose{0.0, 0.0, std::numbers::pi}}) {
    SCOPED_TRACE(fmt::format("goal {} {} {}", goal.x, goal.y, goal.yaw));
    send_goal(goal);
    ASSERT_TRUE(eventually([&] { return navigator.update(); })) << navigator.commands() << " commands";
    const PlanarPose by_tf = *navigator.pose();
    EXPECT_NEAR(by_tf.x, goal.x, 0.03);
    EXPECT_NEAR(by_tf.y, goal.y, 0.03);
    EXPECT_NEAR(wrapped(by_tf.yaw - goal.yaw), 0, 0.03);
    const auto truth = true_pose();
    ASSERT_TRUE(truth.has_value());
    const double turned = start->yaw - from.yaw;
    const double dx = by_tf.x - from.x, dy = by_tf.y - from.y;
    EXPECT_NEAR(truth->x - start->x, std::cos(turned) * dx - std::sin(turned) * dy, 0.05);
    EXPECT_NEAR(truth->y - start->y, std::sin(turned) * dx + std::cos(turned) * dy, 0.05);
    EXPECT_NEAR(wrapped(truth->yaw - start->yaw - (by_tf.yaw - from.yaw)), 0, 0.05);
  }
  EXPECT_EQ(navigator.stale_transforms(), 0);
}

}  // namespace
}  // namespace doppel::ros2_testing
