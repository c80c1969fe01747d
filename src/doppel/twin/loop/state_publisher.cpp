#include "doppel/twin/loop/state_publisher.h"

#include <algorithm>

#include "doppel/base/packages/service_uri.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/ros/bus/standard_node.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/scenario/schema/robot_names.h"
#include "doppel/sensors/rigs/pose_messages.h"

namespace doppel {
namespace {

constexpr const char *kWorld = "world", *kGround = "ground";
constexpr double kMaxPeriod = 1e6;  // s, of /tf

}  // namespace

StatePublisher::StatePublisher(Bus& bus, const RobotDescription& robot, std::shared_ptr<const Model> model,
                               const Options& options)
    : model_(std::move(model)),
      name_space_(options.name_space),
      frames_(options.frames),
      statics_(options.statics),
      node_(bus, in_namespace(name_space_, "robot_state_publisher")) {
  const Qos latched{.depth = 1, .latched = true};
  make_standard(node_);
  description_message_.data = robot.xml;
  description_ = node_.advertise<std_msgs::msg::String>("robot_description", latched);
  if (kHaveResourceService.contains(ros_distro())) {
    remote_description_message_.data =
        with_service_uris(robot.xml, bus.names().resolve(NameKind::service, kResourceService, "/doppel"));
    remote_description_ = node_.advertise<std_msgs::msg::String>("robot_description_remote", latched);
  }
  for (std::size_t j = 0; j < model_->joints.size(); ++j) {
    if (model_->joints[j].nq > 0) moving_joints_.push_back(j);
  }
  const bool alone = name_space_.empty();
  if (alone || options.tf != TfTopics::separate)
    add_tree({.shared = !alone}, "/tf", "/tf_static", options.X_WR);
  if (!alone && options.tf != TfTopics::prefixed) {
    add_tree({.separate = true}, in_namespace(name_space_, "tf"), in_namespace(name_space_, "tf_static"),
             options.X_WR);
  }
  // Only for the graph, as in robot_state_publisher: the states of all joints come from the engine.
  node_.subscribe<sensor_msgs::msg::JointState>(
      "joint_states", [](const auto&) {}, Qos::sensor_data());
  declare_qos_overrides(node_, "joint_states", QosOverrideOf::subscription, Qos::sensor_data(),
                        QosOverridePolicies::without_durability);
  ParameterOverrides written;
  if (options.file != nullptr) written = options.file->overrides_for(node_.name(), node_.given_name());
  declare_parameters(robot, written);
}

StatePublisher::~StatePublisher() {
  const auto own = statics_->find(name_space_);
  if (own != statics_->end() && own->second.publisher == this) statics_->erase(own);
}

void StatePublisher::add_tree(Tree tree, const std::string& tf, const std::string& tf_static,
                              const Pose& X_WR) {
  const Qos latched{.depth = 1, .latched = true}, depth{.depth = 100};
  tree.tf = node_.advertise<tf2_msgs::msg::TFMessage>(tf, depth);
  tree.tf_static = node_.advertise<tf2_msgs::msg::TFMessage>(tf_static, latched);
  tree.topic = node_.bus().names().resolve(NameKind::topic, tf, node_.name());
  declare_qos_overrides(node_, tf, QosOverrideOf::publisher, depth);
  declare_qos_overrides(node_, tf_static, QosOverrideOf::publisher, latched,
                        QosOverridePolicies::without_durability);
  collect_root(tree, *model_, X_WR);
  const Eigen::VectorXd q = model_->neutral();
  for (const ModelJoint& joint : model_->joints) {
    (joint.nq > 0 ? tree.moving : tree.fixed)
        .transforms.push_back(transform_of(model_->links[static_cast<std::size_t>(joint.parent_link)].name,
                                           model_->links[static_cast<std::size_t>(joint.child_link)].name,
                                           parent_to_child(joint, q)));
  }
  for (const FixedFrame& frame : frames_)
    tree.fixed.transforms.push_back(transform_of(frame.parent, frame.name, frame.X_PF));
  trees_.push_back(std::move(tree));
}

void StatePublisher::collect_root(Tree& tree, const Model& model, const Pose& X_WR) {
  const std::string& root = model.links.front().name;
  if (tree.shared || model.find_link(kWorld) < 0) {
    tree.fixed.transforms.push_back(transform_of(kWorld, root, X_WR));
  } else if (!X_WR.isApprox(Pose::Identity()) && model.find_link(kGround) < 0) {
    tree.fixed.transforms.push_back(transform_of(root, kGround, X_WR.inverse()));
  }
}

void StatePublisher::declare_parameters(const RobotDescription& robot, ParameterOverrides& written) {
  Parameters& parameters = node_.parameters();
  parameters.declare(
      "robot_description", robot.xml,
      {.description = "robot description (URDF)", .check = [](const ParameterValue&) {
         return Status::refused(
             "the twin is built from its source files: edit them, or start it with another description");
       }});
  const auto take_frequency = [this](double frequency) {
    period_ = frequency > 0 ? from_seconds(std::min(1.0 / frequency, kMaxPeriod)) : Duration{};
  };
  take_frequency(
      declare<double>(parameters, &written, "publish_frequency", 50.0,
                      {.description = "Hz, of /tf; 0: at every step", .range = ParameterRange{0, 1000}}));
  set_frame_prefix(declare<std::string>(parameters, &written, "frame_prefix",
                                        name_space_.empty() ? "" : name_space_ + "/",
                                        {.description = "prefix of every frame"}));
  declare<bool>(parameters, &written, "ignore_timestamp", false,
                {.description = "of joint_states; not used: /tf is computed from the simulation"});
  parameters.on_change([this, take_frequency](const std::string& name, const ParameterValue& value) {
    if (name == "publish_frequency") take_frequency(std::get<double>(value));
    if (name == "frame_prefix") {
      set_frame_prefix(std::get<std::string>(value));
      publish_latched(node_.bus().now());
    }
  });
}

void StatePublisher::set_frame_prefix(const std::string& prefix) {
  for (Tree& tree : trees_) {
    if (tree.separate) continue;  // its frames have no prefix
    give_back_root(tree);
    // The parent of the first transform of a shared tree is the common world.
    const auto* const from_world = tree.shared ? &tree.fixed.transforms.front() : nullptr;
    const auto rename = [&](geometry_msgs::msg::TransformStamped& transform) {
      for (std::string* frame : {&transform.header.frame_id, &transform.child_frame_id}) {
        if (&transform == from_world && frame == &transform.header.frame_id) continue;
        *frame = prefix + frame->substr(tree.prefix.size());
      }
    };
    for (auto* message : {&tree.moving, &tree.fixed}) {
      for (auto& transform : message->transforms) rename(transform);
    }
    tree.prefix = prefix;
  }
}

// The joint that a floating base has above its root; false: the base is fixed, and its root static.
bool StatePublisher::floats() const {
  return !model_->joints.empty() && model_->joints.front().type == JointType::floating;
}

bool StatePublisher::is_root_of(const Tree& tree, const BaseTransform* base) const {
  if (base == nullptr || base->topic != tree.topic) return false;
  if (!floats() && !tree.shared && model_->find_link(kWorld) >= 0) return false;  // the root has no parent
  const std::string& root = model_->links[floats() ? 1 : 0].name;  // compared in parts: a sum would allocate
  return base->child.size() == tree.prefix.size() + root.size() && base->child.starts_with(tree.prefix) &&
         base->child.ends_with(root);
}

void StatePublisher::give_back_root(Tree& tree) const {
  if (!tree.withheld) return;
  auto& from = (floats() ? tree.moving : tree.fixed).transforms;
  from.insert(from.begin(), std::move(*tree.withheld));
  tree.withheld.reset();
}

void StatePublisher::follow_base_transform(const BaseTransform* base, Time now) {
  bool static_changed = false;
  for (Tree& tree : trees_) {
    const bool withhold = is_root_of(tree, base);
    if (withhold == tree.withheld.has_value()) continue;
    static_changed = static_changed || !floats();
    if (!withhold) {
      give_back_root(tree);
      continue;
    }
    auto& from = (floats() ? tree.moving : tree.fixed).transforms;
    tree.withheld = std::move(from.front());
    from.erase(from.begin());
  }
  if (static_changed) publish_latched(now);
}

void StatePublisher::publish_transforms(Time now, const Eigen::Ref<const Eigen::VectorXd>& q) {
  for (Tree& tree : trees_) {
    if (!tree.tf.has_listeners()) continue;
    const std::size_t first = floats() && tree.withheld ? 1 : 0;
    for (std::size_t i = first; i < moving_joints_.size(); ++i) {
      auto& transform = tree.moving.transforms[i - first];
      transform.header.stamp = to_time_msg(node_.bus().stamp(now));
      write_transform(parent_to_child(model_->joints[moving_joints_[i]], q), transform.transform);
    }
    tree.tf.publish(tree.moving, now);
  }
}

std::shared_ptr<StaticTransforms> static_transforms(const std::vector<StaticTransform>& transforms) {
  constexpr const char* kScenario = "/scenario";  // no namespace of a robot
  auto out = std::make_shared<StaticTransforms>();
  for (const StaticTransform& one : transforms)
    (*out)[kScenario].transforms.push_back(transform_of(one.parent, one.child, one.X_PC));
  return out;
}

void StatePublisher::publish_latched(Time now) {
  for (Tree& tree : trees_) {
    for (auto& transform : tree.fixed.transforms)
      transform.header.stamp = to_time_msg(node_.bus().stamp(now));
    if (tree.separate) {
      tree.tf_static.publish(tree.fixed, now);
      continue;
    }
    (*statics_)[name_space_] = {this, tree.fixed.transforms};
    tf2_msgs::msg::TFMessage all;
    for (const auto& [name_space, of] : *statics_)
      all.transforms.insert(all.transforms.end(), of.transforms.begin(), of.transforms.end());
    tree.tf_static.publish(all, now);
  }
  description_.publish(description_message_, now);
  remote_description_.publish(remote_description_message_, now);
}

}  // namespace doppel
