#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/controllers/detail/broadcaster_parameters.h"
#include "doppel/control/controllers/detail/parameter_value.h"
#include "doppel/control/controllers/detail/sensor_broadcasters.h"

namespace doppel {
namespace {

constexpr double kUnitWithin = 1e-2;  // of the quaternion's squared length, as there

bool is_pose(const geometry_msgs::msg::Pose& pose) {
  const auto& [p, q] = pose;
  const double parts[] = {p.x, p.y, p.z, q.x, q.y, q.z, q.w};
  return std::ranges::all_of(parts, [](double part) { return std::isfinite(part); }) &&
         std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) <= kUnitWithin;
}

}  // namespace

void PoseBroadcaster::on_init(ControllerContext& context) {
  Parameters& parameters = context.node->parameters();
  name_ = context.name;
  log_ = context.log;
  message_.header.frame_id = declare_required_text(context, "frame_id", "frame of the values", "world");
  const std::string pose =
      declare_required_text(context, "pose_name", "prefix of its state interfaces", "tool_pose");
  broadcasts_ = declare<bool>(parameters, context.overrides, "tf.enable", true, {"publish on /tf", true, {}});
  const auto child = declare<std::string>(parameters, context.overrides, "tf.child_frame_id", "",
                                          {"of the transform; empty: pose_name", true, {}});
  const double rate = declare<double>(
      parameters, context.overrides, "tf.publish_rate", 0.0,
      {"Hz at most on /tf; 0: each update; deprecated in Jazzy", true, check_positive_or_zero});
  tf_period_ = rate > 0 ? from_seconds(1 / rate) : Duration{};
  transform_.transforms.resize(1);
  transform_.transforms[0].header.frame_id = message_.header.frame_id;
  transform_.transforms[0].child_frame_id = child.empty() ? pose : child;
  read(pose, {"position.x", "position.y", "position.z", "orientation.x", "orientation.y", "orientation.z",
              "orientation.w"});
  bus_ = &context.node->bus();
  topic_ =
      context.node->advertise<geometry_msgs::msg::PoseStamped>("~/pose", Qos::system_default_publisher());
  if (broadcasts_)
    tf_ = context.node->advertise<tf2_msgs::msg::TFMessage>("/tf", Qos::system_default_publisher());
}

Status PoseBroadcaster::on_activate() {
  next_tf_ = Time::min();
  invalid_ = reported_ = false;
  return {};
}

void PoseBroadcaster::publish_state(Time now) {
  message_.pose = {{value(0), value(1), value(2)}, {value(3), value(4), value(5), value(6)}};
  message_.header.stamp = to_time_msg(bus_->stamp(now));
  if (topic_.has_listeners()) topic_.publish(message_, now);
  invalid_ = !is_pose(message_.pose);
  // After a reset time is before the one that was due.
  if (invalid_ || !broadcasts_ || (now < next_tf_ && next_tf_ - now <= tf_period_)) return;
  next_tf_ = now + tf_period_;
  if (!tf_.has_listeners()) return;
  auto& transform = transform_.transforms[0];
  const auto& [p, q] = message_.pose;
  transform.header.stamp = message_.header.stamp;
  transform.transform.translation = {p.x, p.y, p.z};
  transform.transform.rotation = q;
  tf_.publish(transform_, now);
}

void PoseBroadcaster::housekeeping(Time /*now*/) {
  if (invalid_ && !reported_)
    log_->error(name_,
                fmt::format("the pose of '{}' is not finite, or its quaternion not of unit length; it is not "
                            "published on /tf",
                            interfaces_.front().substr(0, interfaces_.front().rfind('/'))));
  reported_ = invalid_;
}

}  // namespace doppel
