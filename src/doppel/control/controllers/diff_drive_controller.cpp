// Drives a base with wheels on two sides from ~/cmd_vel (geometry_msgs/msg/TwistStamped). Compatible with
// ros2_controllers' diff_drive_controller of ROS 2 Jazzy; ~/set_odometry (control_msgs/srv/SetOdometry) is
// that of later releases.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/controllers/detail/base_controller.h"
#include "doppel/control/controllers/detail/bases.h"

namespace doppel {
namespace {

constexpr const char *kLeftWheels = "left_wheel_names", *kRightWheels = "right_wheel_names";

ParameterOptions not_zero() {
  return {.check = [](const ParameterValue& value) {
    const double factor = std::get<double>(value);
    if (std::isfinite(factor) && factor != 0) return Status{};
    return Status::refused("it must be a number other than 0");
  }};
}

class DiffDriveController : public BaseController {
 public:
  DiffDriveController() : BaseController({.limits = BaseType::Limits::with_deprecated}) {
    window_ = 10;
    position_feedback_ = true;
  }

  void on_init(ControllerContext& context) override {
    declare_parameters(context, joints());
    check_joints_of_sides(context);
    declare_stamps(context);
    BaseController::on_init(context);
  }

 protected:
  ControllerParameters parameters() override {
    const Requirement in_metres = required_for_base("write it in metres");
    constexpr const char* kFactor =
        "correction of the nominal value; negative: the joints' axes point to the right";
    return {
        {"wheel_separation", &separation_, "m, between the wheels of both sides", positive(), in_metres},
        {"wheel_radius", &radius_, "m", positive(), in_metres},
        {"wheel_separation_multiplier", &separation_factor_, "correction of the nominal value", positive()},
        {"left_wheel_radius_multiplier", &left_factor_, kFactor, not_zero()},
        {"right_wheel_radius_multiplier", &right_factor_, kFactor, not_zero()},
        {"open_loop", &open_loop_, "odometry from the commands, not from feedback"},
        {"position_feedback", &position_feedback_,
         "odometry from positions of the wheels, else from velocities"},
        {"cmd_vel_timeout", &timeout_, "s, after which the base brakes without a new command; 0: never",
         not_negative()},
        {"publish_limited_velocity", &publishes_limited_, "on ~/cmd_vel_out"},
        {"velocity_rolling_window_size", &window_, "velocities in the mean of the odometry",
         value_range(1, 10000)}};
  }

  Status arrange() override {
    read_parameters(context_->node->parameters(), joints());
    if (left_.size() != right_.size())
      return Status::refused("left_wheel_names and right_wheel_names differ in number");
    const double turn = separation_ * separation_factor_ / 2;
    wheels_.clear();
    for (const std::string& joint : left_)
      wheels_.push_back({.joint = joint, .measured = joint, .radius = radius_ * left_factor_, .turn = -turn});
    for (const std::string& joint : right_)
      wheels_.push_back({.joint = joint, .measured = joint, .radius = radius_ * right_factor_, .turn = turn});
    if (publishes_limited_ && !limited_topic_) {
      limited_topic_ = context_->node->advertise<geometry_msgs::msg::TwistStamped>(
          "~/cmd_vel_out", Qos::system_default_publisher());
    }
    return {};
  }

  void report(Time now, const PlanarVelocity& velocity) override {
    if (!limited_topic_ || !publishes_limited_ || !limited_topic_->has_listeners()) return;
    limited_.header.stamp = to_time_msg(context_->node->bus().stamp(now));
    limited_.twist.linear.x = velocity.x;
    limited_.twist.angular.z = velocity.yaw;
    limited_topic_->publish(limited_, now);
  }

 private:
  ControllerParameters joints() {
    const Requirement listed = required_for_base("list the joints of that side's wheels: [a]", "is empty");
    return {{kLeftWheels, &left_, "joints of the wheels of one side", {}, listed},
            {kRightWheels, &right_, "joints of the wheels of one side", {}, listed}};
  }

  void check_joints_of_sides(ControllerContext& context) const {
    if (left_.size() != right_.size()) {
      refuse_base_parameter(
          context, kRightWheels,
          fmt::format("has {} names, but '{}' has {}", right_.size(), kLeftWheels, left_.size()),
          "list as many wheels on each side");
    }
    for (const std::string& name : right_) {
      if (std::ranges::find(left_, name) != left_.end())
        refuse_base_parameter(context, kRightWheels,
                              fmt::format("lists '{}', which is also a left wheel", name),
                              "list each wheel on its own side");
    }
    check_driven_joints(context, kLeftWheels, left_);
    check_driven_joints(context, kRightWheels, right_);
  }

  // ROS 2 Humble has commands without stamps, which Jazzy does not have. Reported where a user's file sets
  // it.
  void declare_stamps(ControllerContext& context) {
    constexpr const char* kStamped = "use_stamped_vel";
    bool stamped = true;
    declare_parameters(
        context,
        {{kStamped, &stamped, "of ROS 2 Humble; false: reads Twist on ~/cmd_vel_unstamped", read_only()}});
    if (!stamped) type_.topic = "~/cmd_vel_unstamped";
    report_parameter(
        context, kDeprecated, kStamped,
        fmt::format("is of ROS 2 Humble: {}; Jazzy ignores it and reads TwistStamped on ~/cmd_vel",
                    stamped ? "true has no effect" : "Twist is read on ~/cmd_vel_unstamped"),
        "remove it");
  }

  std::vector<std::string> left_, right_;  // joints of the wheels; equal in number
  double separation_ = 0, radius_ = 0;     // m
  double separation_factor_ = 1, left_factor_ = 1, right_factor_ = 1;
  bool publishes_limited_ = false;
  std::optional<Publisher<geometry_msgs::msg::TwistStamped>> limited_topic_;
  geometry_msgs::msg::TwistStamped limited_;
};

}  // namespace

std::unique_ptr<Controller> make_diff_drive_controller() {
  return std::make_unique<DiffDriveController>();
}

}  // namespace doppel
