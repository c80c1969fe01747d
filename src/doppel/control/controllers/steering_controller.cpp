// Drives a base with steered wheels from ~/reference. Compatible with ros2_controllers'
// steering_controllers_library of ROS 2 Jazzy. Of two wheels the right one is listed first. The steering
// stays where it is without a reference.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/control/controllers/detail/base_controller.h"
#include "doppel/control/controllers/detail/bases.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {
namespace {

constexpr double kStraightAhead = 1e-6;  // rad, of steering
constexpr double kRight = -1, kLeft = 1;
// The default of ros2_controllers, which is the indices of a diagonal and no variances.
const std::vector<double> kSteeringCovariance{0.0, 7.0, 14.0, 21.0, 28.0, 35.0};
constexpr const char *kTractionTrack = "traction_track_width", *kSteeringTrack = "steering_track_width";

double side_of(std::size_t index, std::size_t count) {
  if (count == 1) return 0;
  return index == 0 ? kRight : kLeft;
}

class SteeringController : public BaseController {
 public:
  explicit SteeringController(SteeringKind kind)
      : BaseController({.no_command = NoCommand::stop,
                        .topic = "~/reference",
                        .timeout_parameter = "reference_timeout",
                        .odometry = {.odometry = "~/odometry",
                                     .transform = "~/tf_odometry",
                                     .covariance = kSteeringCovariance,
                                     .prefix = OdometryPublisher::FramePrefix::as_written,
                                     .has_rate = false}}) {
    geometry_.kind = kind;
    timeout_ = 1;
    window_ = 10;
  }

  void on_init(ControllerContext& context) override {
    declare_joints(context);
    declare_geometry(context);
    BaseController::on_init(context);
    for (const char* name : {"pose_covariance_diagonal", "twist_covariance_diagonal"}) {
      if (context.overrides != nullptr && context.overrides->find(name) != nullptr) continue;
      context.log->note(context.name,
                        fmt::format("'{}' has the default of ros2_controllers, [0, 7, 14, 21, 28, 35]: "
                                    "write variances for state estimators",
                                    name));
    }
    state_topic_ = context.node->advertise<control_msgs::msg::SteeringControllerStatus>(
        "~/controller_state", Qos::system_default_publisher());
  }

  void publish_state(Time now) override {
    if (!state_topic_.has_listeners()) return;
    state_.header.stamp = to_time_msg(context_->node->bus().stamp(now));
    auto& feedback = position_feedback_ ? state_.traction_wheels_position : state_.traction_wheels_velocity;
    const std::size_t driven = geometry_.driven();
    for (std::size_t i = 0; i < driven; ++i) {
      feedback[i] = state_handles[i].get();
      state_.linear_velocity_command[i] = state_.traction_command[i] = command_handles[i].get();
    }
    for (std::size_t i = 0; i < geometry_.steered(); ++i) {
      state_.steer_positions[i] = state_handles[driven + i].get();
      state_.steering_angle_command[i] = command_handles[driven + i].get();
    }
    state_topic_.publish(state_, now);
  }

  [[nodiscard]] bool save(SavedSlot& slot) const override {
    Saved& out = value_in<Saved>(slot);
    save_base(out.base);
    out.steering_angle = steering_angle_;
    return true;
  }
  void restore(const SavedPart& saved, Time /*now*/) override {
    const Saved* const before = value_of<Saved>(&saved);
    if (before == nullptr) return;
    restore_base(before->base);
    steering_angle_ = before->steering_angle;
  }

 protected:
  ControllerParameters parameters() override {
    return {{"reference_timeout", &timeout_, "s, for which a reference is valid; 0: for one update",
             not_negative()},
            {"open_loop", &open_loop_, "odometry from the references"},
            {"position_feedback", &position_feedback_,
             "odometry from positions of the driven wheels, else from velocities"},
            {"reduce_wheel_speed_until_steering_reached", &waits_for_steering_,
             "drive slower while the steering turns"},
            {"velocity_rolling_window_size", &window_, "velocities in the mean of the odometry",
             value_range(1, 10000)}};
  }

  Status arrange() override {
    wheels_.clear();
    for (std::size_t i = 0; i < geometry_.driven(); ++i)
      wheels_.push_back({.joint = traction_[i],
                         .measured = (traction_states_.empty() ? traction_ : traction_states_)[i],
                         .radius = geometry_.radius});
    steered_ = steering_;
    steered_measured_ = steering_states_.empty() ? steering_ : steering_states_;
    steering_angle_ = 0;
    (position_feedback_ ? state_.traction_wheels_position : state_.traction_wheels_velocity)
        .assign(geometry_.driven(), 0.0);
    (position_feedback_ ? state_.traction_wheels_velocity : state_.traction_wheels_position).clear();
    for (auto* const command :
         {&state_.linear_velocity_command, &state_.traction_command})  // by distribution
      command->assign(geometry_.driven(), 0.0);
    state_.steer_positions.assign(geometry_.steered(), 0.0);
    state_.steering_angle_command.assign(geometry_.steered(), 0.0);
    state_.header.frame_id = publisher_.odometry_frame();
    return {};
  }

  std::optional<PlanarVelocity> measure(double dt) override {
    const std::size_t driven = geometry_.driven(), steered = geometry_.steered();
    double steering = 0;
    for (std::size_t i = 0; i < steered; ++i) {
      const double angle = state_handles[driven + i].get();
      steering += steered == 1 ? angle : geometry_.middle_angle(angle, side_of(i, 2)) / 2;
    }
    if (std::isfinite(steering)) steering_angle_ = steering;
    double linear = 0;  // the mean of what each wheel gives
    for (std::size_t i = 0; i < driven; ++i) {
      linear += wheel_speed(i, dt) * geometry_.radius /
                geometry_.traction_factor(steering, side_of(i, driven)) / static_cast<double>(driven);
    }
    if (!std::isfinite(linear) || !std::isfinite(steering)) return std::nullopt;
    return PlanarVelocity{linear, 0, std::tan(steering) * linear / geometry_.wheelbase};
  }

  void drive(const PlanarVelocity& velocity, double /*dt*/) override {
    const std::size_t driven = geometry_.driven(), steered = geometry_.steered();
    const double target = geometry_.steering_for(velocity.x, velocity.yaw);
    // The speeds of the driven wheels follow the steering that is, so that no wheel scrubs while it turns.
    const double present = open_loop_ ? target : steering_angle_;
    double speed = velocity.x / geometry_.radius;
    if (waits_for_steering_ && !open_loop_) {
      constexpr double kNear = std::numbers::pi / 6, kFar = 1.5608;  // rad, as in ros2_controllers
      const double error = std::abs(present - target);
      if (error >= kNear) speed *= std::cos(std::min(error, kFar)) / std::cos(kNear);
    }
    for (std::size_t i = 0; i < driven; ++i)
      command_handles[i].set(speed * geometry_.traction_factor(present, side_of(i, driven)));
    for (std::size_t i = 0; i < steered; ++i)
      command_handles[driven + i].set(steered == 1 ? target : geometry_.wheel_angle(target, side_of(i, 2)));
  }

  void stop() override {
    for (std::size_t i = 0; i < geometry_.driven(); ++i) command_handles[i].set(0.0);
  }

 private:
  using Names = std::vector<std::string>;
  struct Saved {
    SavedBase base;
    double steering_angle = 0;
  };

  // A list of joints and its deprecated name, whose value has priority.
  void declare_names(ControllerContext& context, const std::string& parameter, const std::string& old,
                     Names& names, std::size_t expected) {
    declare_parameters(context, {{parameter, &names, "joints; of two, the right one first", read_only()}});
    const bool is_old =
        declare_old_name(context, kDeprecated, {old, &names, "deprecated", read_only()}, parameter);
    const bool optional = parameter.find("state") != std::string::npos;
    if (names.size() == expected || (optional && names.empty())) return;
    refuse_base_parameter(context, is_old ? old : parameter,
                          fmt::format("has {} joints, but this base has {}", names.size(), expected),
                          expected == 1 ? "list one joint" : "list the right and then the left joint");
  }

  void declare_joints(ControllerContext& context) {
    declare_parameters(context, {{"front_steering", &front_steering_,
                                  "deprecated: which of the deprecated lists is steered", read_only()}});
    if (!front_steering_)
      report_parameter(context, kDeprecated, "front_steering", "is deprecated",
                       "write traction_joints_names and steering_joints_names");
    const std::string driven_end = front_steering_ ? "rear" : "front",
                      steered_end = front_steering_ ? "front" : "rear";
    const std::size_t driven = geometry_.driven(), steered = geometry_.steered();
    declare_names(context, "traction_joints_names", driven_end + "_wheels_names", traction_, driven);
    declare_names(context, "steering_joints_names", steered_end + "_wheels_names", steering_, steered);
    declare_names(context, "traction_joints_state_names", driven_end + "_wheels_state_names",
                  traction_states_, driven);
    declare_names(context, "steering_joints_state_names", steered_end + "_wheels_state_names",
                  steering_states_, steered);
    check_driven_joints(context, "traction_joints_names", traction_);
    check_driven_joints(context, "steering_joints_names", steering_);
  }

  void declare_length(ControllerContext& context, const std::string& parameter, double& length,
                      const std::vector<std::string>& old_names, bool is_required = true) {
    declare_parameters(context, {{parameter, &length, "m", read_only(not_negative())}});
    for (const std::string& old : old_names)
      declare_old_name(context, kDeprecated, {old, &length, "deprecated", read_only(not_negative())},
                       parameter);
    if (is_required && length <= 0)
      refuse_base_parameter(context, parameter, "is not set", "write it in metres");
  }

  void declare_geometry(ControllerContext& context) {
    const std::string wheels = geometry_.kind == SteeringKind::bicycle ? "wheel" : "wheels";
    declare_length(context, "wheelbase", geometry_.wheelbase, {});
    declare_length(context, fmt::format("traction_{}_radius", wheels), geometry_.radius,
                   {fmt::format("front_{}_radius", wheels), fmt::format("rear_{}_radius", wheels)});
    if (geometry_.kind == SteeringKind::tricycle)
      declare_length(context, kTractionTrack, geometry_.traction_track, {"wheel_track"});
    if (geometry_.kind != SteeringKind::ackermann) return;
    const std::string front = "front_wheel_track", rear = "rear_wheel_track";
    declare_length(context, kTractionTrack, geometry_.traction_track, {front_steering_ ? rear : front});
    declare_length(context, kSteeringTrack, geometry_.steering_track, {front_steering_ ? front : rear},
                   false);
    if (geometry_.steering_track <= 0) geometry_.steering_track = geometry_.traction_track;
  }

  SteeringGeometry geometry_;
  Names traction_, steering_, traction_states_, steering_states_;  // joints; states: empty: as the commanded
  bool front_steering_ = true, waits_for_steering_ = false;
  double steering_angle_ = 0;  // rad, measured, in the middle
  Publisher<control_msgs::msg::SteeringControllerStatus> state_topic_;
  control_msgs::msg::SteeringControllerStatus state_;
};

}  // namespace

double SteeringGeometry::steering_for(double linear, double angular) const {
  const double angle = std::atan(angular * wheelbase / linear);
  return std::isfinite(angle) ? angle : 0.0;
}

double SteeringGeometry::traction_factor(double steering, double side) const {
  if (std::abs(steering) < kStraightAhead) return 1;
  const double radius_of_turn = wheelbase / std::tan(steering);
  return (radius_of_turn - side * traction_track / 2) / radius_of_turn;
}

double SteeringGeometry::wheel_angle(double steering, double side) const {
  return std::atan2(2 * wheelbase * std::sin(steering),
                    2 * wheelbase * std::cos(steering) - side * steering_track * std::sin(steering));
}

double SteeringGeometry::middle_angle(double wheel, double side) const {
  const double t = std::tan(wheel);
  return std::atan(wheelbase * t / (wheelbase + side * steering_track / 2 * t));
}

std::unique_ptr<Controller> make_steering_controller(SteeringKind kind) {
  return std::make_unique<SteeringController>(kind);
}

}  // namespace doppel
