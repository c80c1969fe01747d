#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/controllers/detail/broadcasters.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"

namespace doppel {
namespace {

constexpr double kUnitWithin = 1e-2;  // of the quaternion's squared length, as there

bool is_pose(const geometry_msgs::msg::Pose& pose) {
  const auto& [p, q] = pose;
  const double parts[] = {p.x, p.y, p.z, q.x, q.y, q.z, q.w};
  return std::ranges::all_of(parts, [](double part) { return std::isfinite(part); }) &&
         std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) <= kUnitWithin;
}

// A pose that is not finite, or whose quaternion is not of unit length, is published and not broadcast as a
// transform.
class PoseBroadcaster : public SensorBroadcaster {
 public:
  void on_init(ControllerContext& context) override {
    name_ = context.name;
    log_ = context.log;
    std::string pose, child;
    double rate = 0;
    declare_parameters(context,
                       {frame_parameter(message_.header.frame_id, "world"),
                        required_text("pose_name", pose, "prefix of its state interfaces", "tool_pose"),
                        {"tf.enable", &broadcasts_, "publish on /tf", read_only()},
                        {"tf.child_frame_id", &child, "of the transform; empty: pose_name", read_only()},
                        {"tf.publish_rate", &rate, "Hz at most on /tf; 0: each update; deprecated in Jazzy",
                         read_only(not_negative())}});
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

  Status on_activate() override {
    run_.next_tf = Time::min();
    run_.invalid = run_.reported = false;
    return {};
  }

  void publish_state(Time now) override {
    message_.pose = {{value(0), value(1), value(2)}, {value(3), value(4), value(5), value(6)}};
    message_.header.stamp = to_time_msg(bus_->stamp(now));
    if (topic_.has_listeners()) topic_.publish(message_, now);
    run_.invalid = !is_pose(message_.pose);
    // After a reset time is before the one that was due.
    if (run_.invalid || !broadcasts_ || (now < run_.next_tf && run_.next_tf - now <= tf_period_)) return;
    run_.next_tf = now + tf_period_;
    if (!tf_.has_listeners()) return;
    auto& transform = transform_.transforms[0];
    const auto& [p, q] = message_.pose;
    transform.header.stamp = message_.header.stamp;
    transform.transform.translation = {p.x, p.y, p.z};
    transform.transform.rotation = q;
    tf_.publish(transform_, now);
  }

  [[nodiscard]] bool save(SavedSlot& slot) const override { return save_run(run_, slot); }
  void restore(const SavedPart& saved, Time /*now*/) override { restore_run(saved, run_); }

  void housekeeping(Time /*now*/) override {
    if (run_.invalid && !run_.reported)
      log_->error(
          name_,
          fmt::format("the pose of '{}' is not finite, or its quaternion not of unit length; it is not "
                      "published on /tf",
                      interfaces_.front().substr(0, interfaces_.front().rfind('/'))));
    run_.reported = run_.invalid;
  }

 private:
  std::string name_;
  const Log* log_ = nullptr;
  Bus* bus_ = nullptr;
  bool broadcasts_ = true;
  Duration tf_period_{};  // 0: at each update
  // The state that changes while the controller runs.
  struct Run {
    bool invalid = false, reported = false;
    Time next_tf = Time::min();
  } run_;
  geometry_msgs::msg::PoseStamped message_;
  tf2_msgs::msg::TFMessage transform_;
  Publisher<geometry_msgs::msg::PoseStamped> topic_;
  Publisher<tf2_msgs::msg::TFMessage> tf_;
};

}  // namespace

std::unique_ptr<Controller> make_pose_broadcaster() {
  return std::make_unique<PoseBroadcaster>();
}

}  // namespace doppel
