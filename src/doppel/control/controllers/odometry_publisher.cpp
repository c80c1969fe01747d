#include "doppel/control/controllers/detail/odometry_publisher.h"

#include <fmt/format.h>

#include <cmath>

#include "doppel/control/controllers/detail/parameter_value.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

constexpr std::size_t kDegrees = 6;  // x, y, z and the rotations about them

Status check_diagonal(const ParameterValue& value) {
  const auto& diagonal = std::get<std::vector<double>>(value);
  if (diagonal.size() == kDegrees) return {};
  return Status::refused(fmt::format(
      "it has {} values; write one each for x, y, z and the rotations about them", diagonal.size()));
}

void fill_diagonal(const std::vector<double>& diagonal, std::array<double, 36>& covariance) {
  for (std::size_t i = 0; i < kDegrees; ++i) covariance[i * (kDegrees + 1)] = diagonal[i];
}

// The namespace of a node as a prefix of frames: "/left/base" -> "left/", "/base" -> "".
std::string prefix_of_namespace(const std::string& node) {
  const std::size_t slash = node.find_last_of('/');
  return slash == 0 || slash == std::string::npos ? "" : node.substr(1, slash);
}

// The root link of the description: a floating base has a link "world" and a joint above it (model.h).
const std::string& base_link(const Model& model) {
  const bool floats = !model.joints.empty() && model.joints.front().type == JointType::floating;
  return model.links[floats ? 1 : 0].name;
}

}  // namespace

void OdometryPublisher::declare_frames(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  ParameterOverrides* written = context.overrides;
  if (options_.has_prefix) {
    doppel::declare<bool>(parameters, written, "tf_frame_prefix_enable", true,
                          {"whether frames have a prefix", false, {}});
    doppel::declare<std::string>(
        parameters, written, "tf_frame_prefix", "",
        {"of both frames; empty: the controller's namespace, which '~' stands for", false, {}});
  }
  doppel::declare<std::string>(parameters, written, "odom_frame_id", "odom",
                               {"frame of the odometry", false, {}});
  const auto base = doppel::declare<std::string>(parameters, written, "base_frame_id", "base_link",
                                                 {"frame of the base, a child of odom_frame_id", false, {}});
  const Model& model = *context.model;
  const std::string& root = base_link(model);
  if (base == root || model.find_link(base) < 0) return;  // a frame that the user's own nodes connect
  log_diagnostic(
      *context.log, context.name,
      {Severity::warning, "control.base_frame",
       fmt::format("'base_frame_id' is '{}', but the root link is '{}': on /tf '{}' gets a second parent, "
                   "and its pose jumps between both",
                   base, root, base),
       place_of(context, "base_frame_id"), fmt::format("write base_frame_id: {}", root)});
}

// Some controllers publish the transform on a topic of their own, which no listener of TF reads.
void OdometryPublisher::report_transform_topic(const ControllerContext& context) const {
  const std::string own =
      context.node->bus().names().resolve(NameKind::topic, options_.transform, context.node->name());
  if (!options_.transform.starts_with('~') || own.ends_with("/tf")) return;
  if (!parameter_value<bool>(*parameters_, "enable_odom_tf")) return;
  context.log->note(context.name, fmt::format("the transform of the base is on {}, as in ros2_controllers, "
                                              "and not on /tf; add --ros-args -r {}:=/tf "
                                              "for RViz, Nav2 and other listeners of TF",
                                              own, own));
}

void OdometryPublisher::declare(ControllerContext& context, const Options& options) {
  Parameters& parameters = context.node->parameters();
  ParameterOverrides* written = context.overrides;
  node_ = context.node;
  bus_ = &context.node->bus();
  parameters_ = &parameters;
  options_ = options;
  declare_frames(context);
  for (const std::string& name : {options.pose_covariance, options.twist_covariance}) {
    doppel::declare<std::vector<double>>(
        parameters, written, name, options_.covariance,
        {"variances of x, y, z and the rotations about them in ~/odom", false, check_diagonal});
  }
  doppel::declare<bool>(parameters, written, "enable_odom_tf", options.sends_transform,
                        {"publish odom_frame_id -> base_frame_id on /tf", false, {}});
  if (options.has_only_twist)
    doppel::declare<bool>(parameters, written, "odom_only_twist", false,
                          {"no pose in ~/odom, for a node that integrates the velocity", false, {}});
  if (options_.has_rate) {
    doppel::declare<double>(parameters, written, "publish_rate", 50.0,
                            {"Hz, of the odometry and its transform", false, check_positive});
  }
  const Qos qos = Qos::system_default_publisher();
  odometry_topic_ = context.node->advertise<nav_msgs::msg::Odometry>(options_.odometry, qos);
  transform_topic_ = context.node->advertise<tf2_msgs::msg::TFMessage>(options_.transform, qos);
  base_transform_.topic =
      context.node->bus().names().resolve(NameKind::topic, options_.transform, context.node->name());
  report_transform_topic(context);
  transform_.transforms.resize(1);
}

std::string OdometryPublisher::frame_prefix() const {
  if (!options_.has_prefix || !parameter_value<bool>(*parameters_, "tf_frame_prefix_enable")) return "";
  const std::string own = prefix_of_namespace(node_->name());
  std::string prefix = parameter_value<std::string>(*parameters_, "tf_frame_prefix");
  if (prefix.empty()) return own;
  if (const std::size_t tilde = prefix.find('~'); tilde != std::string::npos) prefix.replace(tilde, 1, own);
  if (prefix.back() != '/') prefix += '/';
  while (prefix.front() == '/' && prefix.size() > 1) prefix.erase(0, 1);
  while (prefix.ends_with("//")) prefix.pop_back();
  return prefix == "/" ? "" : prefix;
}

Status OdometryPublisher::configure() {
  const std::string prefix = frame_prefix();
  base_transform_.parent = prefix + parameter_value<std::string>(*parameters_, "odom_frame_id");
  base_transform_.child = prefix + parameter_value<std::string>(*parameters_, "base_frame_id");
  if (base_transform_.parent == base_transform_.child)
    return Status::refused(
        fmt::format("'odom_frame_id' and 'base_frame_id' are both '{}'", base_transform_.child));
  odometry_ = {};
  odometry_.header.frame_id = transform_.transforms[0].header.frame_id = base_transform_.parent;
  odometry_.child_frame_id = transform_.transforms[0].child_frame_id = base_transform_.child;
  fill_diagonal(parameter_value<std::vector<double>>(*parameters_, options_.pose_covariance),
                odometry_.pose.covariance);
  fill_diagonal(parameter_value<std::vector<double>>(*parameters_, options_.twist_covariance),
                odometry_.twist.covariance);
  sends_tf_ = parameter_value<bool>(*parameters_, "enable_odom_tf");
  only_twist_ = options_.has_only_twist && parameter_value<bool>(*parameters_, "odom_only_twist");
  if (options_.has_rate) period_ = from_seconds(1.0 / parameter_value<double>(*parameters_, "publish_rate"));
  last_.reset();
  return {};
}

void OdometryPublisher::publish(Time now, const PlanarOdometry& odometry) {
  if (last_ && *last_ <= now && now - *last_ < period_) return;
  // Also after time was set back.
  const bool first = !last_ || *last_ > now || period_ == Duration{};
  last_ = first ? now : *last_ + (now - *last_) / period_ * period_;
  const PlanarPose& pose = odometry.pose();
  const PlanarVelocity& velocity = odometry.velocity();
  const geometry_msgs::msg::Quaternion rotation{0, 0, std::sin(pose.yaw / 2), std::cos(pose.yaw / 2)};
  const auto stamp = to_time_msg(bus_->stamp(now));
  odometry_.header.stamp = stamp;
  if (!only_twist_) {
    odometry_.pose.pose.position = {pose.x, pose.y, 0};
    odometry_.pose.pose.orientation = rotation;
  }
  odometry_.twist.twist.linear = {velocity.x, velocity.y, 0};
  odometry_.twist.twist.angular = {0, 0, velocity.yaw};
  odometry_topic_.publish(odometry_, now);
  if (!sends_tf_) return;
  auto& transform = transform_.transforms[0];
  transform.header.stamp = stamp;
  transform.transform.translation = {pose.x, pose.y, 0};
  transform.transform.rotation = rotation;
  transform_topic_.publish(transform_, now);
}

}  // namespace doppel
