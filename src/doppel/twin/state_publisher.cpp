#include "doppel/twin/state_publisher.h"

#include <algorithm>

#include "doppel/bus/standard_node.h"
#include "doppel/kinematics/kinematics.h"
#include "doppel/messages/sensor_msgs.h"
#include "doppel/twin/pose_messages.h"

namespace doppel {
namespace {

constexpr const char *kWorld = "world", *kGround = "ground";
constexpr double kLongestPeriod = 1e6;  // s, of /tf

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
                               const ParameterFile* file)
    : model_(model), node_(bus, "/robot_state_publisher") {
  const Qos latched{.depth = 1, .latched = true}, tf{.depth = 100};
  make_standard(node_);
  description_message_.data = robot.xml;
  description_ = node_.advertise<std_msgs::msg::String>("robot_description", latched);
  tf_ = node_.advertise<tf2_msgs::msg::TFMessage>("/tf", tf);
  tf_static_ = node_.advertise<tf2_msgs::msg::TFMessage>("/tf_static", latched);
  // Only to be seen in the graph: the states of all joints are known.
  node_.subscribe<sensor_msgs::msg::JointState>(
      "joint_states", [](const auto&) {}, Qos::sensor_data());
  if (bus.sim_time()) {
    clock_node_.emplace(bus, "/gazebo");
    clock_ = clock_node_->advertise<rosgraph_msgs::msg::Clock>("/clock");
  }
  declare_qos_overrides(node_, "/tf", QosOverrideOf::publisher, tf);
  declare_qos_overrides(node_, "/tf_static", QosOverrideOf::publisher, latched,
                        QosOverridePolicies::without_durability);
  declare_qos_overrides(node_, "joint_states", QosOverrideOf::subscription, Qos::sensor_data(),
                        QosOverridePolicies::without_durability);
  collect_transforms(X_WR);
  ParameterOverrides written;
  if (file != nullptr) written = file->overrides_for(node_.name(), node_.given_name());
  declare_parameters(robot, written);
}

void StatePublisher::declare_parameters(const RobotDescription& robot, ParameterOverrides& written) {
  Parameters& parameters = node_.parameters();
  parameters.declare(
      "robot_description", robot.xml,
      {.description = "the robot, as URDF", .check = [](const ParameterValue&) {
         return Status::refused(
             "the twin is built from its sources: edit and save them, or start it with another "
             "description");
       }});
  const auto take_frequency = [this](double frequency) {
    period_ = frequency > 0 ? from_seconds(std::min(1.0 / frequency, kLongestPeriod)) : Duration{};
  };
  take_frequency(
      declare<double>(parameters, &written, "publish_frequency", 50.0,
                      {.description = "Hz, of /tf; 0: at every step", .range = ParameterRange{0, 1000}}));
  set_frame_prefix(
      declare<std::string>(parameters, &written, "frame_prefix", "", {.description = "before every frame"}));
  declare<bool>(parameters, &written, "ignore_timestamp", false,
                {.description = "of joint_states, which are not what /tf is made of here"});
  parameters.on_change([this, take_frequency](const std::string& name, const ParameterValue& value) {
    if (name == "publish_frequency") take_frequency(std::get<double>(value));
    if (name == "frame_prefix") {
      set_frame_prefix(std::get<std::string>(value));
      publish_latched(node_.bus().now());
    }
  });
}

void StatePublisher::set_frame_prefix(const std::string& prefix) {
  for (auto* message : {&moving_, &fixed_}) {
    for (auto& transform : message->transforms) {
      for (std::string* frame : {&transform.header.frame_id, &transform.child_frame_id})
        *frame = prefix + frame->substr(frame_prefix_.size());
    }
  }
  frame_prefix_ = prefix;
}

void StatePublisher::collect_transforms(const Pose& X_WR) {
  const Model& model = model_;
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
    moving_.transforms[i].header.stamp = to_time_msg(node_.bus().stamp(now));
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
  for (auto& transform : fixed_.transforms) transform.header.stamp = to_time_msg(node_.bus().stamp(now));
  tf_static_.publish(fixed_, now);
  description_.publish(description_message_, now);
}

}  // namespace doppel
