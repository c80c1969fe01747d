// Drives a base on three or more omni wheels, evenly spaced on a circle with their axles to its centre, from
// ~/cmd_vel. Compatible with ros2_controllers' omni_wheel_drive_controller of ROS 2 Jazzy and later: wheels
// anti-clockwise, the first one at `wheel_offset` from the base's x axis; a wheel that turns by the right
// hand about the outward axle drives the base to the right, seen from the centre. There are no limits.
// ~/set_odometry (control_msgs/srv/SetOdometry) is that of later releases.

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <set>

#include "doppel/control/controllers/detail/base_controller.h"
#include "doppel/control/controllers/detail/bases.h"

namespace doppel {
namespace {

constexpr const char* kOmniWheels = "wheel_names";
constexpr std::size_t kMinOmniWheels = 3;  // two of them cannot move a base in every direction

class OmniWheelDriveController : public BaseController {
 public:
  OmniWheelDriveController()
      : BaseController({.shortest_timeout = Duration{1},
                        .sideways = true,
                        .odometry = {.pose_covariance = "diagonal_covariance.pose",
                                     .twist_covariance = "diagonal_covariance.twist",
                                     .has_rate = false}}) {
    position_feedback_ = true;
  }

  void on_init(ControllerContext& context) override {
    declare_parameters(
        context, {{kOmniWheels, &joints_, "joints of the wheels, anti-clockwise from the one at wheel_offset",
                   read_only()}});
    if (joints_.size() < kMinOmniWheels) {
      refuse_base_parameter(
          context, kOmniWheels,
          fmt::format("has {} joints, but a base on omni wheels has three or more", joints_.size()),
          "list all wheels, anti-clockwise from the one at wheel_offset");
    }
    if (std::set(joints_.begin(), joints_.end()).size() != joints_.size())
      refuse_base_parameter(context, kOmniWheels, "lists a joint twice", "list each wheel once");
    check_driven_joints(context, kOmniWheels, joints_);
    BaseController::on_init(context);
    if (timeout_ == 0)
      report_parameter(
          context, "control.base_parameter", type_.timeout_parameter,
          "is 0, which this controller does not take as 'never': a command is used in one update "
          "at most",
          "write the time-out in seconds");
  }

 protected:
  ControllerParameters parameters() override {
    const Requirement in_metres = required_for_base("write it in metres");
    return {{"wheel_offset", &offset_, "rad, from the base's x axis to the first wheel", read_only(),
             required_for_base("write the angle from the base's x axis to the first wheel, in radians")},
            {"robot_radius", &robot_radius_, "m", read_only(positive()), in_metres},
            {"wheel_radius", &wheel_radius_, "m", read_only(positive()), in_metres},
            {"open_loop", &open_loop_, "odometry from the commands, not from feedback", read_only()},
            {"position_feedback", &position_feedback_,
             "odometry from positions of the wheels, else from velocities", read_only()},
            {type_.timeout_parameter, &timeout_,
             "s, after which the base stops without a new command; 0: at once", read_only(not_negative())}};
  }

  Status arrange() override {
    wheels_.clear();
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const double angle =
          offset_ + 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(joints_.size());
      wheels_.push_back({.joint = joints_[i],
                         .measured = joints_[i],
                         .radius = wheel_radius_,
                         .ahead = std::sin(angle),
                         .aside = -std::cos(angle),
                         .turn = -robot_radius_});
    }
    return {};
  }

 private:
  std::vector<std::string> joints_;
  double offset_ = 0;                           // rad
  double robot_radius_ = 0, wheel_radius_ = 0;  // m
};

}  // namespace

std::unique_ptr<Controller> make_omni_wheel_drive_controller() {
  return std::make_unique<OmniWheelDriveController>();
}

}  // namespace doppel
