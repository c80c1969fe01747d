// Drives a base with one wheel that is driven and steered, as of a forklift, from ~/cmd_vel
// (geometry_msgs/msg/TwistStamped). Compatible with ros2_controllers' tricycle_controller of ROS 2 Jazzy: it
// turns on the spot by steering to 90 degrees, drives slower until the angle is reached, and limits the speed
// of the wheel (rad/s) and the angle. ~/odom at each update, and odom -> base on /tf with enable_odom_tf;
// ~/reset_odometry (std_srvs/srv/Empty). It has no references for a chain.

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "doppel/control/controllers/detail/base_controller.h"
#include "doppel/control/controllers/detail/bases.h"
#include "doppel/control/controllers/detail/tricycle_limiter.h"
#include "doppel/ros/messages/ackermann_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

constexpr double kFullSpeedBelow = std::numbers::pi / 6;  // rad, between the present and the commanded angle
constexpr double kMinScale = 0.01;                        // of the speed, beyond a right angle

class TricycleController : public BaseController {
 public:
  TricycleController()
      : BaseController({.no_command = NoCommand::brake,
                        .shortest_timeout = Duration{1},  // 0 is no time at all there, not "never"
                        .has_references = false,
                        .odometry = {.prefix = OdometryPublisher::FramePrefix::none,
                                     .has_rate = false,
                                     .has_only_twist = true,
                                     .sends_transform = false}}) {
    window_ = 10;
  }

  void on_init(ControllerContext& context) override {
    const Requirement joint_set = required_for_base("write the joint of the wheel");
    declare_parameters(context, {{"traction_joint_name", &traction_, "joint of the wheel", {}, joint_set},
                                 {"steering_joint_name", &steering_, "joint of the wheel", {}, joint_set}});
    check_driven_joints(context, "traction_joint_name", {traction_});
    check_driven_joints(context, "steering_joint_name", {steering_});
    BaseController::on_init(context);
    context.node->serve<std_srvs::srv::Empty>("~/reset_odometry",
                                              [this](const auto& /*request*/, auto respond) {
                                                odometry_.reset();
                                                respond({});
                                              });
  }

  [[nodiscard]] bool save(SavedSlot& slot) const override {
    Saved& out = value_in<Saved>(slot);
    save_base(out.base);
    out.speeds = speeds_;
    out.angles = angles_;
    return true;
  }
  void restore(const SavedPart& saved, Time /*now*/) override {
    const Saved* const before = value_of<Saved>(&saved);
    if (before == nullptr) return;
    restore_base(before->base);
    speeds_ = before->speeds;
    angles_ = before->angles;
  }

 protected:
  ControllerParameters parameters() override {
    const Requirement in_metres = required_for_base("write it in metres");
    const ParameterOptions whole_number{.check = [](const ParameterValue& value) {
      return std::get<std::int64_t>(value) >= 0 ? Status{} : Status::refused("it must be at least 0");
    }};
    ControllerParameters list{{"wheelbase", &wheelbase_, "m", positive(), in_metres},
                              {"wheel_radius", &wheel_radius_, "m", positive(), in_metres},
                              {"open_loop", &open_loop_, "odometry from the commands, not from feedback"},
                              {"publish_ackermann_command", &publishes_command_, "on ~/cmd_ackermann"},
                              {type_.timeout_parameter, &timeout_ms_,
                               "ms, after which the base brakes without a new command", whole_number},
                              {"velocity_rolling_window_size", &window_,
                               "velocities in the mean of the odometry", value_range(1, 10000)}};
    const auto add = [&list](const std::string& name, double& least, double& most, const char* description) {
      const std::size_t dot = name.find('.') + 1;
      for (const auto& [end, value] : {std::pair("min_", &least), std::pair("max_", &most)})
        list.emplace_back(std::string(name).insert(dot, end), value, description);
    };
    constexpr const char* kTraction = "magnitude, of the wheel in rad/s and its derivatives; NaN: none";
    constexpr const char* kSteering = "of the steering in rad and its derivatives; NaN: none";
    TractionLimits& traction = written_traction_;
    SteeringLimits& steering = written_steering_;
    add("traction.velocity", traction.velocity.min, traction.velocity.max, kTraction);
    add("traction.acceleration", traction.acceleration.min, traction.acceleration.max, kTraction);
    add("traction.deceleration", traction.deceleration.min, traction.deceleration.max, kTraction);
    add("traction.jerk", traction.jerk.min, traction.jerk.max, kTraction);
    add("steering.position", steering.min_position, steering.max_position, kSteering);
    add("steering.velocity", steering.velocity.min, steering.velocity.max, kSteering);
    add("steering.acceleration", steering.acceleration.min, steering.acceleration.max, kSteering);
    return list;
  }

  Status arrange() override {
    TractionLimits traction = written_traction_;
    SteeringLimits steering = written_steering_;
    if (Status fine = traction.complete(); !fine) return fine;
    if (Status fine = steering.complete(); !fine) return fine;
    traction_limits_ = traction;
    steering_limits_ = steering;
    timeout_ = static_cast<double>(timeout_ms_) / 1000;
    wheels_ = {{.joint = traction_, .measured = traction_, .radius = wheel_radius_}};
    steered_ = steered_measured_ = {steering_};
    if (publishes_command_ && !ackermann_topic_) {
      ackermann_topic_ = context_->node->advertise<ackermann_msgs::msg::AckermannDrive>(
          "~/cmd_ackermann", Qos::system_default_publisher());
    }
    return {};
  }

  std::optional<PlanarVelocity> measure(double /*dt*/) override {
    const double speed = state_handles[0].get(), angle = state_handles[1].get();
    if (!std::isfinite(speed + angle)) return std::nullopt;
    const double along = speed * wheel_radius_;  // of the wheel, m/s
    return PlanarVelocity{along * std::cos(angle), 0, along * std::sin(angle) / wheelbase_};
  }

  void drive(const PlanarVelocity& velocity, double dt) override {
    double angle = 0, speed = 0;
    if (velocity.x == 0 && velocity.yaw != 0) {
      angle = std::copysign(std::numbers::pi / 2, velocity.yaw);
      speed = std::abs(velocity.yaw) * wheelbase_ / wheel_radius_;
    } else {
      angle = velocity.x == 0 ? 0 : std::atan(velocity.yaw * wheelbase_ / velocity.x);
      speed = velocity.x / (wheel_radius_ * std::cos(angle));
    }
    if (const double missing = std::abs(angle - state_handles[1].get()); missing >= kFullSpeedBelow)
      speed *= missing > std::numbers::pi / 2 ? kMinScale : std::cos(missing);
    speed = traction_limits_.limit(speed, speeds_, dt);
    angle = steering_limits_.limit(angle, angles_, dt);
    speeds_.push(speed);
    angles_.push(angle);
    command_handles[0].set(speed);
    command_handles[1].set(angle);
  }

  void rest() override {
    speeds_ = {};
    angles_ = {};
  }

  void report(Time now, const PlanarVelocity& /*velocity*/) override {
    if (!ackermann_topic_ || !ackermann_topic_->has_listeners()) return;
    ackermann_msgs::msg::AckermannDrive message;  // its speed is that of the wheel, as in ros2_controllers
    message.steering_angle = static_cast<float>(command_handles[1].get());
    message.speed = static_cast<float>(command_handles[0].get());
    ackermann_topic_->publish(message, now);
  }

 private:
  struct Saved {
    SavedBase base;
    LastTwo speeds, angles;
  };

  std::string traction_, steering_;          // joints
  double wheelbase_ = 0, wheel_radius_ = 0;  // m
  bool publishes_command_ = false;
  std::int64_t timeout_ms_ = 500;
  TractionLimits written_traction_, traction_limits_;  // as written, and complete
  SteeringLimits written_steering_, steering_limits_;
  LastTwo speeds_, angles_;
  std::optional<Publisher<ackermann_msgs::msg::AckermannDrive>> ackermann_topic_;
};

}  // namespace

std::unique_ptr<Controller> make_tricycle_controller() {
  return std::make_unique<TricycleController>();
}

}  // namespace doppel
