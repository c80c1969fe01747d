#include "doppel/twin/mirror/detail/robot_mirror.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/control/hardware/nan.h"
#include "doppel/physics/contract/described_servo.h"
#include "doppel/scenario/schema/robot_names.h"

namespace doppel {
namespace {

constexpr const char* kOrigin = "mirror";
constexpr std::array kModes{"shadow", "follow", "off", "rehearse"};
// The first signs of one cause can be those of another.
constexpr Duration kCauseTime{250'000'000};

std::string percent(double share) {
  return std::isfinite(share) ? fmt::format("{:.0f} %", 100 * std::abs(share)) : std::string("unknown");
}

// The sigma of a joint whose servo was identified; 0: it was not.
double sigma_of(const std::vector<DescribedServo>& servos, const ModelJoint& joint) {
  for (const DescribedServo& servo : servos) {
    if (servo.joint == joint.name && servo.rms > 0.0) return *servo.rms;
  }
  return 0;
}

}  // namespace

RobotMirror::RobotMirror(Bus& bus, const TwinRobot& robot, MirrorMode mode)
    : mode_(mode),
      node_(bus, in_namespace(robot.name_space(), "doppel")),
      topic_(node_.advertise<doppel_msgs::msg::Mirror>("~/mirror")) {
  const Model& model = robot.model();
  Diagnostics reported;  // where the robot is compiled
  const std::vector<DescribedServo> servos = described_servos(robot.machine().description(), reported);
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    if (!joint.scalar() || joint.mimics()) continue;
    Joint one;
    one.name = joint.name;
    one.position = joint.name + "/" + kPosition;
    one.velocity = joint.name + "/" + kVelocity;
    one.joint = static_cast<int>(i);
    one.q = static_cast<std::size_t>(joint.q);
    one.effort = robot.machine().servos()[i].effort;
    if (const double sigma = sigma_of(servos, joint); sigma > 0)
      one.residual = JointResidual(ResidualOptions{.sigma = sigma});
    joints_.push_back(std::move(one));
  }
  message_.mode = kModes[static_cast<std::size_t>(mode)];
  restart();
}

void RobotMirror::restart() {
  next_sample_ = Time::min();
  for (Joint& joint : joints_) {
    joint.residual.restart();
    joint.goal = joint.load = joint.model_load = joint.measured_q = kNaN;
  }
}

void RobotMirror::after_step(const TwinRobot& robot, Time now) {
  if (now < next_sample_) return;
  next_sample_ = std::max(next_sample_, now - JointResidual::kPeriod) + JointResidual::kPeriod;
  const Instance& twin = robot.instance();
  for (Joint& joint : joints_) {
    joint.measured = robot.is_measured(joint.joint);
    joint.measured_q = joint.measured ? robot.controller_manager().state(joint.position) : kNaN;
    joint.twin_q = twin.q()[joint.q];
    // Before the hardware is active and after it has stopped, the twin only follows it.
    joint.shadowed = joint.measured && robot.is_shadow();
    joint.model_load = joint.shadowed && std::isfinite(joint.effort) && joint.effort > 0
                           ? twin.drive_effort()[static_cast<std::size_t>(joint.joint)] / joint.effort
                           : kNaN;
    if (!joint.shadowed || joint.believed || joint.released) {
      joint.residual.restart();
      continue;
    }
    joint.residual.add({joint.measured_q, joint.twin_q, joint.load, joint.model_load, joint.held_back});
  }
}

// The driver moves the joint towards the command, and slower than commanded: at a gentle speed, a high
// temperature, or its limit of motion ahead.
bool RobotMirror::is_held_back(const TwinRobot& robot, const Joint& joint) const {
  constexpr double kApart = 0.05, kMoves = 0.05;  // rad, rad/s
  const double command = robot.controller_manager().command(joint.position);
  const double velocity = robot.controller_manager().state(joint.velocity);
  if (!std::isfinite(command) || !std::isfinite(joint.goal) || !std::isfinite(velocity)) return false;
  const double way = command - joint.measured_q;
  return std::abs(command - joint.goal) > kApart && velocity * way > 0 && std::abs(velocity) > kMoves;
}

void RobotMirror::look(const TwinRobot& robot, const RobotDevices& devices, Time now, const Log& log) {
  for (Joint& joint : joints_) {
    const doppel_msgs::msg::DeviceJoint* const device = devices.find(joint.name);
    joint.load = device != nullptr ? device->load : kNaN;
    joint.goal = device != nullptr ? device->goal : kNaN;
    joint.believed = device != nullptr && device->believed;
    // A joint that was caught waits for a command near to where it is.
    const double command = robot.controller_manager().command(joint.position);
    const bool waits = joint.released && std::abs(command - joint.goal) > kRejoin;
    joint.released = device != nullptr && (device->released || waits);
    joint.held_back = is_held_back(robot, joint);
    log_alarm(joint, now, log);
  }
}

void RobotMirror::log_alarm(Joint& joint, Time now, const Log& log) const {
  if (joint.residual.alarm() == ResidualCause::none || joint.logged == joint.residual.alarms()) {
    joint.alarm_since = now;
    return;
  }
  if (now - joint.alarm_since < kCauseTime) return;
  joint.logged = joint.residual.alarms();
  log.warning(kOrigin, fmt::format("'{}' is not where its twin is: {}", joint.name, alarm_text(joint)));
}

std::string RobotMirror::alarm_text(const Joint& joint) const {
  const double error = joint.residual.error();
  const std::string loads =
      fmt::format("load {}, in the twin {}", percent(joint.load), percent(joint.model_load));
  const std::string size = fmt::format("{:.3f} apart", std::abs(error));
  switch (joint.residual.alarm()) {
    case ResidualCause::none:
      return "";
    case ResidualCause::stall:
      return fmt::format("stall: it stands still while the twin moves ({}, {})", size, loads);
    case ResidualCause::payload:
      return fmt::format("payload: it carries more than the description says ({}, {})", size, loads);
    case ResidualCause::slipped_horn:
      return fmt::format("slipped horn: its reading is off by an amount that no motion explains ({})", size);
    case ResidualCause::lost_power:
      return fmt::format("lost power: the servo pushes with no torque ({}, {})", size, loads);
    case ResidualCause::wrong_direction:
      return fmt::format("wrong direction: it moves against the twin ({})", size);
    case ResidualCause::unknown:
      break;
  }
  return fmt::format("unknown cause ({}, {})", size, loads);
}

std::string RobotMirror::note(const Joint& joint) const {
  if (joint.believed) return "the servo reports no position: the measured one is what it was commanded";
  if (!joint.measured) return "its position is not read";
  if (mode_ == MirrorMode::off) return "the twin gets no commands (mirror: off)";
  if (mode_ == MirrorMode::follow) return "the twin is put where the joint is (mirror: follow)";
  if (!joint.shadowed) return "no controller commands it: the twin follows the joint";
  if (joint.released)
    return "its torque is off for a short time (/doppel/hardware/release_joint), or it waits for a command "
           "near to it";
  return joint.held_back ? "its driver moves it slower than commanded" : "";
}

void RobotMirror::publish(const TwinRobot& robot, Time now) {
  if (!topic_.has_listeners()) return;
  message_.header.stamp = to_time_msg(node_.bus().stamp(now));
  message_.joints.resize(joints_.size());
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = joints_[i];
    doppel_msgs::msg::MirrorJoint& row = message_.joints[i];
    row.name = joint.name;
    row.measured = joint.measured_q;
    row.twin = robot.instance().q()[joint.q];
    row.believed = joint.believed;
    row.error = joint.residual.error();
    row.rms = joint.residual.rms();
    row.delay = joint.shadowed ? joint.residual.delay() : kNaN;
    row.load = joint.load;
    row.model_load = joint.model_load;
    row.note = note(joint);
    row.alarm = alarm_text(joint);
  }
  topic_.publish(message_, now);
}

}  // namespace doppel
