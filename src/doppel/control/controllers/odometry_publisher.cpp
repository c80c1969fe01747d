#include "doppel/control/controllers/detail/odometry_publisher.h"

#include <fmt/format.h>

#include <cmath>

#include "doppel/control/manager/joint_list.h"

namespace doppel {
namespace {

constexpr std::size_t kDegrees = 6;  // x, y, z and the rotations about them

ParameterOptions six_numbers() {
  return {.check = [](const ParameterValue& value) {
    const std::size_t count = std::get<std::vector<double>>(value).size();
    if (count == kDegrees) return Status{};
    return Status::refused(
        fmt::format("it has {} values; write one each for x, y, z and the rotations about them", count));
  }};
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

ControllerParameters OdometryPublisher::parameters() {
  ControllerParameters list{{"odom_frame_id", &odometry_frame_, "frame of the odometry"},
                            {"base_frame_id", &base_frame_, "frame of the base, a child of odom_frame_id"},
                            {options_.pose_covariance, &pose_covariance_,
                             "variances of x, y, z and the rotations about them in ~/odom", six_numbers()},
                            {options_.twist_covariance, &twist_covariance_,
                             "variances of x, y, z and the rotations about them in ~/odom", six_numbers()},
                            {"enable_odom_tf", &sends_tf_, "publish odom_frame_id -> base_frame_id on /tf"}};
  const bool of_namespace = options_.prefix == FramePrefix::of_namespace;
  if (of_namespace) list.emplace_back("tf_frame_prefix_enable", &has_prefix_, "whether frames have a prefix");
  if (options_.prefix != FramePrefix::none) {
    list.emplace_back("tf_frame_prefix", &prefix_,
                      of_namespace ? "of both frames; empty: the controller's namespace, which '~' stands for"
                                   : "of both frames; '~' stands for the controller's namespace");
  }
  if (options_.has_only_twist)
    list.emplace_back("odom_only_twist", &only_twist_,
                      "no pose in ~/odom, for a node that integrates the velocity");
  if (options_.has_rate)
    list.emplace_back("publish_rate", &rate_, "Hz, of the odometry and its transform", positive());
  return list;
}

void OdometryPublisher::report_base_frame(const ControllerContext& context) const {
  const std::string& root = base_link(*context.model);
  // A frame that is no link is connected by the user's own nodes.
  if (base_frame_ == root || context.model->find_link(base_frame_) < 0) return;
  log_diagnostic(
      *context.log, context.name,
      {Severity::warning, "control.base_frame",
       fmt::format("'base_frame_id' is '{}', but the root link is '{}': on /tf '{}' gets a second parent, "
                   "and its pose jumps between both",
                   base_frame_, root, base_frame_),
       place_of(context, "base_frame_id"), fmt::format("write base_frame_id: {}", root)});
}

// Some controllers publish the transform on a topic of their own, which no listener of TF reads.
void OdometryPublisher::report_transform_topic(const ControllerContext& context) const {
  const std::string& topic = base_transform_.topic;
  if (!options_.transform.starts_with('~') || topic.ends_with("/tf") || !sends_tf_) return;
  context.log->note(context.name, fmt::format("the transform of the base is on {}, as in ros2_controllers, "
                                              "and not on /tf; add --ros-args -r {}:=/tf "
                                              "for RViz, Nav2 and other listeners of TF",
                                              topic, topic));
}

void OdometryPublisher::declare(ControllerContext& context, const Options& options) {
  node_ = context.node;
  options_ = options;
  pose_covariance_ = twist_covariance_ = options.covariance;
  sends_tf_ = options.sends_transform;
  declare_parameters(context, parameters());
  report_base_frame(context);
  const Qos qos = Qos::system_default_publisher();
  odometry_topic_ = context.node->advertise<nav_msgs::msg::Odometry>(options_.odometry, qos);
  transform_topic_ = context.node->advertise<tf2_msgs::msg::TFMessage>(options_.transform, qos);
  base_transform_.topic =
      context.node->bus().names().resolve(NameKind::topic, options_.transform, context.node->name());
  report_transform_topic(context);
  transform_.transforms.resize(1);
}

std::string OdometryPublisher::frame_prefix() const {
  if (!has_prefix_) return "";
  const std::string own = prefix_of_namespace(node_->name());
  std::string prefix = prefix_;
  if (prefix.empty()) return options_.prefix == FramePrefix::of_namespace ? own : "";
  if (const std::size_t tilde = prefix.find('~'); tilde != std::string::npos) prefix.replace(tilde, 1, own);
  if (prefix.back() != '/') prefix += '/';
  while (prefix.front() == '/' && prefix.size() > 1) prefix.erase(0, 1);
  while (prefix.ends_with("//")) prefix.pop_back();
  return prefix == "/" ? "" : prefix;
}

Status OdometryPublisher::configure() {
  read_parameters(node_->parameters(), parameters());
  const std::string prefix = frame_prefix();
  base_transform_.parent = prefix + odometry_frame_;
  base_transform_.child = prefix + base_frame_;
  if (base_transform_.parent == base_transform_.child)
    return Status::refused(
        fmt::format("'odom_frame_id' and 'base_frame_id' are both '{}'", base_transform_.child));
  odometry_ = {};
  odometry_.header.frame_id = transform_.transforms[0].header.frame_id = base_transform_.parent;
  odometry_.child_frame_id = transform_.transforms[0].child_frame_id = base_transform_.child;
  fill_diagonal(pose_covariance_, odometry_.pose.covariance);
  fill_diagonal(twist_covariance_, odometry_.twist.covariance);
  period_ = options_.has_rate ? from_seconds(1.0 / rate_) : Duration{};
  last_.reset();
  return {};
}

void OdometryPublisher::publish(Time now, const PlanarOdometry& odometry) {
  if (last_ && *last_ <= now && now - *last_ < period_) return;
  // Also after time was set back.
  const bool first = !last_ || *last_ > now || period_ == Duration{};
  last_ = first ? now : *last_ + (now - *last_) / period_ * period_;
  const OdometryPose& pose = odometry.pose();
  const PlanarVelocity& velocity = odometry.velocity();
  const geometry_msgs::msg::Quaternion rotation{0, 0, std::sin(pose.yaw / 2), std::cos(pose.yaw / 2)};
  const auto stamp = to_time_msg(node_->bus().stamp(now));
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
