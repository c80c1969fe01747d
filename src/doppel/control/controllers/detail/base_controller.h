#pragma once
// The common part of the controllers of mobile bases: commands with a time-out, the references of a chain,
// limits, odometry, and the kinematics of a table of wheels. Compatible with ros2_controllers of ROS 2 Jazzy.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "doppel/control/controllers/detail/odometry_publisher.h"
#include "doppel/control/controllers/detail/planar_odometry.h"
#include "doppel/control/controllers/detail/speed_limit_parameters.h"
#include "doppel/control/controllers/detail/twist_command.h"

namespace doppel {

// A driven wheel. The position of its contact, the direction of its axle and that of its rollers determine
// how fast its rim has to move for a velocity of the base: ahead * x + aside * y + turn * yaw, m/s.
struct DrivenWheel {
  std::string joint, measured;  // its velocity is commanded; its state is read
  double radius = 0;            // m; negative: the axis of the joint points to the other side
  double ahead = 1, aside = 0;
  double turn = 0;     // m
  double last = kNaN;  // rad, at the last update; NaN: none since it was configured
};

// The behaviour of a base before the first command, and after one has timed out.
enum class NoCommand {
  wait,   // nothing before the first one, without odometry; then the references are zero
  brake,  // the velocity is zero, through the limits
  stop    // there is no reference, and the wheels are commanded to stop
};

// The differences between the types of bases.
struct BaseType {
  NoCommand no_command = NoCommand::wait;
  std::string topic = "~/cmd_vel";  // of commands
  const char* timeout_parameter = "cmd_vel_timeout";
  Duration shortest_timeout{};  // what a time-out of 0 is; 0: by `no_command`, never or one update
  bool sideways = false;        // it moves in every direction
  bool has_references = true;   // it can follow another controller in a chain
  enum class Limits { none, present, with_deprecated } limits = Limits::none;
  OdometryPublisher::Options odometry = {};
};

class BaseController : public Controller {
 public:
  void on_init(ControllerContext& context) override;
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override;
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override;
  [[nodiscard]] std::vector<std::string> reference_interfaces() const override;
  Status on_configure() override;
  Status on_activate() override;
  Status on_deactivate() override;
  void update(Time now, Duration period) override;
  void housekeeping(Time now) override;
  void set_chained_mode(bool chained) override;
  [[nodiscard]] const BaseTransform* base_transform() const override { return publisher_.base_transform(); }
  [[nodiscard]] bool save(SavedSlot& slot) const override {
    save_base(value_in<SavedBase>(slot));
    return true;
  }
  void restore(const SavedPart& saved, Time /*now*/) override {
    if (const SavedBase* before = value_of<SavedBase>(&saved)) restore_base(*before);
  }

 protected:
  // The state that changes while the controller runs.
  struct SavedBase {
    PlanarVelocity reference;
    std::array<SpeedLimiter::Past, 3> limiters;
    TwistCommand::Run command;
    std::vector<double> wheels;  // DrivenWheel::last
    PlanarOdometry odometry;
    std::optional<Time> published;
    bool invalid_state = false, invalid_state_reported = false;
  };
  void save_base(SavedBase& out) const;
  void restore_base(const SavedBase& saved);

  explicit BaseController(BaseType type) : type_(std::move(type)) {}

  // The parameters that the type adds; those that can be changed are read again at each configuration.
  virtual ControllerParameters parameters() = 0;
  // Fills wheels_ and steered_ from the parameters.
  virtual Status arrange() = 0;

  // In the loop. The velocity of the base by its wheels; nullopt: a state is not a number.
  virtual std::optional<PlanarVelocity> measure(double dt);
  virtual void drive(const PlanarVelocity& velocity, double dt);
  virtual void stop();
  virtual void rest();  // forgets the history of limits
  virtual void report(Time now, const PlanarVelocity& /*velocity*/) { publish_state(now); }
  // rad/s, by the position or the velocity of the wheel.
  double wheel_speed(std::size_t wheel, double dt);

  BaseType type_;
  ControllerContext* context_ = nullptr;
  std::vector<DrivenWheel> wheels_;   // the first handles are theirs, in order
  std::vector<std::string> steered_;  // joints whose position is commanded; the handles after the wheels
  std::vector<std::string> steered_measured_;  // joints whose position is read
  double timeout_ = 0.5;                       // s
  std::int64_t window_ = 1;                    // velocities in the mean of the odometry
  bool open_loop_ = false;                     // odometry from the commands
  bool position_feedback_ = false;             // odometry from positions of the wheels, else from velocities
  PlanarOdometry odometry_;
  OdometryPublisher publisher_;

 private:
  [[nodiscard]] bool is_limited(std::size_t component) const;
  void take_reference(Time now);
  void read_reference();
  void set_reference(const PlanarVelocity& reference);
  void forget();

  PlanarVelocity reference_;                    // NaN: none
  std::array<SpeedLimitParameters, 3> limits_;  // x, y, yaw
  std::array<SpeedLimiter, 3> limiters_;
  TwistCommand command_;
  bool active_ = false, chained_ = false, uses_once_ = false;
  bool invalid_state_ = false, invalid_state_reported_ = false;
};

// The joints of a parameter, which is a string or a list. Throws InputError for one that cannot be driven.
void check_driven_joints(const ControllerContext& context, const std::string& parameter,
                         const std::vector<std::string>& joints);
[[noreturn]] void refuse_base_parameter(const ControllerContext& context, const std::string& parameter,
                                        const std::string& why, const std::string& fix);

}  // namespace doppel
