#include "doppel/twin/loop/detail/ground_truth.h"

#include <utility>

#include "doppel/scenario/schema/robot_names.h"
#include "doppel/sensors/rigs/pose_messages.h"

namespace doppel {
namespace {

constexpr Duration kTruthPeriod{20'000'000};

}  // namespace

GroundTruth::GroundTruth(Bus& bus, const CompiledRobot& robot, Present instance, Time now)
    : instance_(std::move(instance)),
      shares_world_(!robot.name_space().empty()),
      node_(bus, in_namespace(robot.name_space(), "doppel")) {
  topic_ = node_.advertise<nav_msgs::msg::Odometry>("ground_truth/odom");
  const ModelInstance& made_of = robot.instance();
  message_.header.frame_id = "world";
  const bool prefixed = shares_world_ && robot.asked().tf != TfTopics::separate;
  message_.child_frame_id = (prefixed ? robot.name_space() + "/" : "") +
                            made_of.model->links[static_cast<std::size_t>(made_of.base_link())].name;
  pace_.restart(now);
}

Duration GroundTruth::period() const {
  return whole_steps(kTruthPeriod, instance_().engine().world().settings().step);
}

Time GroundTruth::publish(Time now) {
  show(now);
  return pace_.next(now, period());
}

void GroundTruth::show(Time now) {
  if (!topic_.has_listeners()) return;
  const Pose X_WB = instance_().base_pose();
  const int world = shares_world_ ? -1 : instance_().model().find_link("world");
  const Pose X_TB =
      world < 0 ? X_WB : instance_().link_pose(world).inverse() * X_WB;  // T: the frame "world" of TF
  const FrameVelocity V_WB = instance_().base_velocity();
  message_.header.stamp = to_time_msg(node_.bus().stamp(now));
  message_.pose.pose = to_pose_msg(X_TB);
  message_.twist.twist.linear = to_vector_msg(X_WB.linear().transpose() * V_WB.linear_W);
  message_.twist.twist.angular = to_vector_msg(X_WB.linear().transpose() * V_WB.angular_W);
  topic_.publish(message_, now);
}

}  // namespace doppel
