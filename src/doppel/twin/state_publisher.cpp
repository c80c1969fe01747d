#include "doppel/twin/state_publisher.h"

#include "doppel/kinematics/kinematics.h"
#include "doppel/twin/pose_messages.h"

namespace doppel {
namespace {

constexpr const char *kWorld = "world", *kGround = "ground";

void write_transform(const Pose& X, geometry_msgs::msg::Transform& out) {
  const geometry_msgs::msg::Pose pose = to_pose_msg(X);
  out.translation = {pose.position.x, pose.position.y, pose.position.z};
  out.rotation = pose.orientation;
}

geometry_msgs::msg::TransformStamped transform_of(const std::string& parent, const std::string& child,
                                                  const Pose& X_PC) {
  geometry_msgs::msg::TransformStamped out;
  out.header.frame_id = parent;
  out.child_frame_id = child;
  write_transform(X_PC, out.transform);
  return out;
}

}  // namespace

StatePublisher::StatePublisher(Bus& bus, const RobotDescription& robot, const Model& model, const Pose& X_WR,
                               StampedBy time)
    : model_(model), node_(bus, "/robot_state_publisher") {
  const Qos latched{.depth = 1, .latched = true};
  description_ = node_.advertise<std_msgs::msg::String>("/robot_description", latched);
  tf_ = node_.advertise<tf2_msgs::msg::TFMessage>("/tf", {.depth = 100});
  tf_static_ = node_.advertise<tf2_msgs::msg::TFMessage>("/tf_static", latched);
  if (time == StampedBy::simulation) {
    clock_node_.emplace(bus, "/gazebo");
    clock_ = clock_node_->advertise<rosgraph_msgs::msg::Clock>("/clock");
  }
  description_message_.data = robot.xml;

  if (model.find_link(kWorld) < 0) {
    fixed_.transforms.push_back(transform_of(kWorld, model.links.front().name, X_WR));
  } else if (!X_WR.isApprox(Pose::Identity()) && model.find_link(kGround) < 0) {
    fixed_.transforms.push_back(transform_of(model.links.front().name, kGround, X_WR.inverse()));
  }
  const Eigen::VectorXd q = model.neutral();
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const ModelJoint& joint = model.joints[j];
    auto transform =
        transform_of(model.links[static_cast<std::size_t>(joint.parent_link)].name,
                     model.links[static_cast<std::size_t>(joint.child_link)].name, parent_to_child(joint, q));
    if (joint.nq > 0) {
      moving_joints_.push_back(j);
      moving_.transforms.push_back(std::move(transform));
    } else {
      fixed_.transforms.push_back(std::move(transform));
    }
  }
}

void StatePublisher::publish_transforms(Time now, const Eigen::Ref<const Eigen::VectorXd>& q) {
  if (!tf_.has_listeners()) return;
  for (std::size_t i = 0; i < moving_joints_.size(); ++i) {
    moving_.transforms[i].header.stamp = to_time_msg(now);
    write_transform(parent_to_child(model_.joints[moving_joints_[i]], q), moving_.transforms[i].transform);
  }
  tf_.publish(moving_, now);
}

void StatePublisher::publish_clock(Time now) {
  if (!clock_.has_listeners()) return;
  rosgraph_msgs::msg::Clock message;
  message.clock = to_time_msg(now);
  clock_.publish(message, now);
}

void StatePublisher::publish_latched(Time now) {
  for (auto& transform : fixed_.transforms) transform.header.stamp = to_time_msg(now);
  tf_static_.publish(fixed_, now);
  description_.publish(description_message_, now);
}

}  // namespace doppel
