// Drives a base with four mecanum wheels from ~/reference. Compatible with ros2_controllers'
// mecanum_drive_controller of ROS 2 Jazzy. Order of the wheels: front left, front right, rear right, rear
// left.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/controllers/detail/base_controller.h"
#include "doppel/control/controllers/detail/bases.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {
namespace {

constexpr std::size_t kMecanumWheels = 4;
constexpr std::array<const char*, kMecanumWheels> kWheelNames{"front_left", "front_right", "rear_right",
                                                              "rear_left"};
// Of each wheel: how its speed depends on the base's velocity to the left and on its turn.
constexpr std::array<double, kMecanumWheels> kAside{-1, 1, -1, 1}, kTurn{-1, 1, 1, -1};

class MecanumDriveController : public BaseController {
 public:
  MecanumDriveController()
      : BaseController({.no_command = NoCommand::stop,
                        .topic = "~/reference",
                        .timeout_parameter = "reference_timeout",
                        .sideways = true,
                        .limits = BaseType::Limits::present,
                        .odometry = {.odometry = "~/odometry",
                                     .transform = "~/tf_odometry",
                                     .covariance = std::vector<double>(6, 0.1),
                                     .has_rate = false}}) {
    timeout_ = 0;
  }

  void on_init(ControllerContext& context) override {
    declare_wheels(context);
    BaseController::on_init(context);
    state_topic_ = context.node->advertise<control_msgs::msg::MecanumDriveControllerState>(
        "~/controller_state", Qos::system_default_publisher());
  }

  void publish_state(Time now) override {
    if (!state_topic_.has_listeners()) return;
    state_.header.stamp = to_time_msg(context_->node->bus().stamp(now));
    state_.front_left_wheel_velocity = state_handles[0].get();
    state_.front_right_wheel_velocity = state_handles[1].get();
    state_.back_right_wheel_velocity = state_handles[2].get();
    state_.back_left_wheel_velocity = state_handles[3].get();
    state_.reference_velocity.linear.x = reference_handles[0].get();
    state_.reference_velocity.linear.y = reference_handles[1].get();
    state_.reference_velocity.angular.z = reference_handles[2].get();
    state_topic_.publish(state_, now);
  }

 protected:
  ControllerParameters parameters() override {
    const Requirement in_metres = required_for_base("write it in metres");
    constexpr const char* kOffset = "of the base's frame in that of the wheels' centre, m or rad";
    return {{"reference_timeout", &timeout_, "s, for which a reference is valid; 0: for one update",
             not_negative()},
            {"kinematics.wheels_radius", &radius_, "m", read_only(positive()), in_metres},
            {"kinematics.sum_of_robot_center_projection_on_X_Y_axis", &reach_, "m", read_only(positive()),
             in_metres},
            {"kinematics.base_frame_offset.x", &offset_.x, kOffset, read_only()},
            {"kinematics.base_frame_offset.y", &offset_.y, kOffset, read_only()},
            {"kinematics.base_frame_offset.theta", &offset_.yaw, kOffset, read_only()}};
  }

  Status arrange() override {
    wheels_.clear();
    for (std::size_t i = 0; i < kMecanumWheels; ++i) {
      wheels_.push_back({.joint = commanded_[i],
                         .measured = measured_[i].empty() ? commanded_[i] : measured_[i],
                         .radius = radius_,
                         .aside = kAside[i],
                         .turn = kTurn[i] * reach_});
    }
    state_.header.frame_id = publisher_.odometry_frame();
    return {};
  }

  // The wheels give the velocity of their centre.
  std::optional<PlanarVelocity> measure(double dt) override {
    const std::optional<PlanarVelocity> centre = BaseController::measure(dt);
    if (!centre) return std::nullopt;
    const double c = std::cos(offset_.yaw), s = std::sin(offset_.yaw);
    const double x = centre->x - centre->yaw * offset_.y, y = centre->y + centre->yaw * offset_.x;
    return PlanarVelocity{c * x + s * y, -s * x + c * y, centre->yaw};
  }

  void drive(const PlanarVelocity& base, double dt) override {
    const double c = std::cos(offset_.yaw), s = std::sin(offset_.yaw);
    BaseController::drive({c * base.x - s * base.y + offset_.y * base.yaw,
                           s * base.x + c * base.y - offset_.x * base.yaw, base.yaw},
                          dt);
  }

 private:
  void declare_wheels(ControllerContext& context) {
    const Requirement joint_set = required_for_base("write the joint of that wheel");
    for (std::size_t i = 0; i < kMecanumWheels; ++i) {
      const std::string name = fmt::format("{}_wheel_command_joint_name", kWheelNames[i]);
      declare_parameters(context, {{name, &commanded_[i], "joint of the wheel", read_only(), joint_set},
                                   {fmt::format("{}_wheel_state_joint_name", kWheelNames[i]), &measured_[i],
                                    "joint whose velocity is read; empty: the commanded one", read_only()}});
      check_driven_joints(context, name, {commanded_[i]});
      if (std::ranges::find(commanded_, commanded_[i]) != &commanded_[i])
        refuse_base_parameter(context, name,
                              fmt::format("is '{}', which is another wheel, too", commanded_[i]),
                              "write the joint of that wheel");
    }
  }

  std::array<std::string, kMecanumWheels> commanded_, measured_;  // joints
  double radius_ = 0, reach_ = 0;  // m; reach: sum of the distances along x and y to a wheel
  OdometryPose offset_;            // of the base's frame in that of the wheels' centre
  Publisher<control_msgs::msg::MecanumDriveControllerState> state_topic_;
  control_msgs::msg::MecanumDriveControllerState state_;
};

}  // namespace

std::unique_ptr<Controller> make_mecanum_drive_controller() {
  return std::make_unique<MecanumDriveController>();
}

}  // namespace doppel
