#include "doppel/review/identification/recorded_motion.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/time.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {
namespace {

using ControllerState = control_msgs::msg::JointTrajectoryControllerState;
using doppel_msgs::msg::Devices;
using sensor_msgs::msg::JointState;

constexpr double kQuiet = 1.0;        // s, of rest before and behind the motion
constexpr double kStandstill = 1e-3;  // of the command's range, in which it counts as unchanged
// Half the window of velocities and accelerations, at least this many samples. The accelerations of other
// joints are short: positions that are not rounded are not smoothed.
struct Window {
  double time;  // s
  std::size_t samples;
};
constexpr Window kRoundedWindow{0.03, 3}, kExactWindow{0.0, 1};
constexpr double kMinTurnMotion = 0.02, kMinSlideMotion = 0.002;  // rad, m, of a command that moves a joint
constexpr std::size_t kYieldingPeriod = 100;                      // samples
constexpr double kDefaultDelay = 0.01;                            // s
constexpr double kFaster = 3;       // a limit that is not described, over the fastest command
constexpr double kFullError = 0.2;  // rad or m, at which an effort that is not described is reached

void add_sample(PositionCurve& curve, double time, double position) {
  if (!std::isfinite(position) || (!curve.time.empty() && time <= curve.time.back())) return;
  curve.time.push_back(time);
  curve.position.push_back(position);
}

void add_samples(std::map<std::string, PositionCurve>& curves, double time,
                 const std::vector<std::string>& names, const std::vector<double>& positions) {
  for (std::size_t i = 0; i < std::min(names.size(), positions.size()); ++i)
    add_sample(curves[names[i]], time, positions[i]);
}

double time_of(const builtin_interfaces::msg::Time& stamp, std::uint64_t log_time) {
  const double time = to_seconds(from_msg(stamp));
  return time > 0 ? time : 1e-9 * static_cast<double>(log_time);
}

// From the first report behind the end of each: the goal is where the joint was caught.
void add_releases(const Devices& devices, std::map<std::string, std::vector<RecordedRelease>>& out) {
  for (const doppel_msgs::msg::Device& device : devices.devices) {
    for (const doppel_msgs::msg::DeviceJoint& joint : device.joints) {
      const double off = to_seconds(from_msg(joint.torque_off)), on = to_seconds(from_msg(joint.torque_on));
      if (joint.released || !(on > off) || !(off > 0)) continue;
      std::vector<RecordedRelease>& ended = out[std::string(joint.name)];
      if (ended.empty() || ended.back().torque_off < off) ended.push_back({off, on, joint.goal});
    }
  }
}

double value_at(const std::vector<double>& times, const std::vector<double>& values, double time) {
  const auto behind = std::ranges::lower_bound(times, time);
  if (behind == times.begin()) return values.front();
  if (behind == times.end()) return values.back();
  const auto i = static_cast<std::size_t>(behind - times.begin());
  const double w = (time - times[i - 1]) / (times[i] - times[i - 1]);
  return values[i - 1] + w * (values[i] - values[i - 1]);
}

// -- the motion of a joint, smoothed

struct SmoothCurve {
  int q = -1, v = -1;  // of the model
  std::vector<double> time, position, velocity, acceleration;
};

// Parabolas over the neighbours of each sample, by least squares.
SmoothCurve smoothed(const PositionCurve& curve, double begin, double end) {
  SmoothCurve out;
  const std::vector<double>& t = curve.time;
  const std::size_t n = t.size();
  const Window window = estimate_tick(curve.position) > 0 ? kRoundedWindow : kExactWindow;
  const double unit = n > 1 ? (t.back() - t.front()) / static_cast<double>(n - 1) : 1.0;
  const auto low = static_cast<std::size_t>(std::ranges::lower_bound(t, begin) - t.begin());
  for (std::size_t i = low; i < n && t[i] <= end; ++i) {
    std::size_t first = i, last = i;
    while (first > 0 && (t[i] - t[first - 1] <= window.time || i - first < window.samples)) --first;
    while (last + 1 < n && (t[last + 1] - t[i] <= window.time || last - i < window.samples)) ++last;
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (std::size_t k = first; k <= last; ++k) {
      const double s = (t[k] - t[i]) / unit;
      const Eigen::Vector3d row(1, s, s * s);
      H += row * row.transpose();
      g += row * (curve.position[k] - curve.position[i]);
    }
    const Eigen::Vector3d c = H.ldlt().solve(g);
    out.time.push_back(t[i]);
    out.position.push_back(curve.position[i]);
    out.velocity.push_back(c[1] / unit);
    out.acceleration.push_back(2 * c[2] / (unit * unit));
  }
  return out;
}

// -- loads

struct Load {
  double load = 0, inertia = 0;
};

// The robot along its measured motion.
class MeasuredRobot {
 public:
  MeasuredRobot(const Model& model, const MeasuredMotion& motion, double begin, double end)
      : model_(model),
        data_(model),
        q_(model.neutral()),
        v_(Eigen::VectorXd::Zero(model.nv)),
        a_(Eigen::VectorXd::Zero(model.nv)) {
    for (const ModelJoint& joint : model.joints) {
      const auto found = motion.measured.find(joint.name);
      if (!joint.scalar() || joint.mimics() || found == motion.measured.end()) continue;
      SmoothCurve curve = smoothed(found->second, begin, end);
      if (curve.time.empty()) continue;
      curve.q = joint.q;
      curve.v = joint.v;
      curves_.push_back(std::move(curve));
    }
  }

  // Joints that mimic it move with it, and belong to its load.
  Load load_of(int joint, double time, const Eigen::Vector3d& gravity) {
    move(time);
    inverse_dynamics(model_, data_, q_, v_, a_, gravity);
    mass_matrix(model_, data_, q_);
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(model_.nv);
    const ModelJoint& leader = model_.joints[static_cast<std::size_t>(joint)];
    direction[leader.v] = 1;
    for (const ModelJoint& other : model_.joints) {
      if (other.mimic_leader == joint) direction[other.v] = other.mimic_multiplier;
    }
    const double inertia = direction.dot(data_.M * direction);
    return {direction.dot(data_.tau) - inertia * a_[leader.v], inertia};
  }

  // The share by which the joint's inertia is smaller in the first moment of a motion, in which the other
  // joints yield, than with all others held.
  double yielding_of(int joint, double time) {
    move(time);
    mass_matrix(model_, data_, q_);
    std::vector<int> drives;
    for (int i = 0; i < static_cast<int>(model_.joints.size()); ++i) {
      const ModelJoint& one = model_.joints[static_cast<std::size_t>(i)];
      if (one.scalar() && !one.mimics()) drives.push_back(i);
    }
    Eigen::MatrixXd R = Eigen::MatrixXd::Zero(model_.nv, static_cast<Eigen::Index>(drives.size()));
    Eigen::Index column = 0, place = 0;
    for (const int drive : drives) {
      if (drive == joint) place = column;
      R(model_.joints[static_cast<std::size_t>(drive)].v, column) = 1;
      for (const ModelJoint& other : model_.joints) {
        if (other.mimic_leader == drive) R(other.v, column) = other.mimic_multiplier;
      }
      ++column;
    }
    const Eigen::MatrixXd M = R.transpose() * data_.M * R;
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(M.rows(), place);
    const double inverse = M.ldlt().solve(unit)[place];
    return inverse > 0 && M(place, place) > 0 ? std::max(0.0, 1 - 1 / (inverse * M(place, place))) : 0.0;
  }

 private:
  void move(double time) {
    for (const SmoothCurve& curve : curves_) {
      q_[curve.q] = value_at(curve.time, curve.position, time);
      v_[curve.v] = value_at(curve.time, curve.velocity, time);
      a_[curve.v] = value_at(curve.time, curve.acceleration, time);
    }
    model_.apply_mimics(q_);
    for (const ModelJoint& joint : model_.joints) {
      if (!joint.mimics()) continue;
      const int leader = model_.joints[static_cast<std::size_t>(joint.mimic_leader)].v;
      v_[joint.v] = joint.mimic_multiplier * v_[leader];
      a_[joint.v] = joint.mimic_multiplier * a_[leader];
    }
  }

  const Model& model_;
  Data data_;
  Eigen::VectorXd q_, v_, a_;
  std::vector<SmoothCurve> curves_;
};

// -- the record of one joint

const PositionCurve& curve_of(const std::map<std::string, PositionCurve>& curves, const std::string& joint,
                              const char* rule, const char* what, const char* fix) {
  const auto found = curves.find(joint);
  if (found != curves.end() && found->second.time.size() > 1) return found->second;
  throw InputError(rule, {}, fmt::format("the recording has no {} of '{}'", what, joint), fix);
}

struct Span {
  double begin = 0, end = 0;
};

Span moving_span(const PositionCurve& command, const ModelJoint& joint) {
  const auto [least, most] = std::ranges::minmax(command.position);
  const double small = kStandstill * (most - least);
  const std::vector<double>& p = command.position;
  const auto differs = [&](double one, double other) { return std::abs(one - other) > small; };
  std::size_t first = 0, last = p.size() - 1;
  while (first + 1 < p.size() && !differs(p[first + 1], p.front())) ++first;
  while (last > 0 && !differs(p[last - 1], p.back())) --last;
  if (!is_moved(joint, command) || first >= last) {
    throw InputError("identify.no_motion", {}, fmt::format("the command of '{}' does not change", joint.name),
                     "record a motion of the joint: doppel identify record");
  }
  return {command.time[first] - kQuiet, command.time[last] + kQuiet};
}

}  // namespace

bool is_moved(const ModelJoint& joint, const PositionCurve& command) {
  const double least = joint.type == JointType::prismatic ? kMinSlideMotion : kMinTurnMotion;
  const auto [low, high] = std::ranges::minmax(command.position);
  return high - low > least;
}

MeasuredMotion read_recorded_motion(BagReader& bag) {
  MeasuredMotion out;
  bag.seek(0, UINT64_MAX,
           {.types = {std::string(JointState::kType), std::string(ControllerState::kType),
                      std::string(Devices::kType)}});
  Devices devices;
  JointState joints;
  ControllerState controller;
  while (const auto message = bag.next()) {
    const BagTopic& topic = bag.contents().topics[message->topic];
    if (topic.type == ControllerState::kType) {
      if (!from_cdr(message->data, controller)) continue;
      const bool has_output = !controller.output.positions.empty();
      add_samples(out.commanded, time_of(controller.header.stamp, message->log_time), controller.joint_names,
                  has_output ? controller.output.positions : controller.reference.positions);
      continue;
    }
    if (topic.type == Devices::kType) {
      if (from_cdr(message->data, devices)) add_releases(devices, out.released);
      continue;
    }
    const bool commands = topic.name.ends_with("joint_commands") || topic.name.ends_with("joint_command");
    if ((!commands && !topic.name.ends_with("joint_states")) || !from_cdr(message->data, joints)) continue;
    add_samples(commands ? out.commanded : out.measured, time_of(joints.header.stamp, message->log_time),
                joints.name, joints.position);
    if (!commands)
      add_samples(out.efforts, time_of(joints.header.stamp, message->log_time), joints.name, joints.effort);
  }
  return out;
}

namespace {

// A driver follows commands again from the first one that is near to where the joint was caught (kRejoin).
void add_spans(const std::vector<RecordedRelease>& releases, double zero, JointRecord& record) {
  const std::vector<double>& t = record.command_time;
  for (const RecordedRelease& one : releases) {
    ReleasedSpan span{one.torque_off - zero, one.torque_on - zero, one.caught, record.time.back()};
    if (span.begin < record.time.front() || span.end > record.time.back()) continue;
    for (std::size_t k = 1; k < t.size(); ++k) {
      if (t[k] <= span.end || std::abs(record.command[k] - one.caught) > kRejoin) continue;
      span.follows = t[k - 1];
      break;
    }
    record.released.push_back(span);
  }
}

}  // namespace

JointRecord joint_record(const Model& model, const std::string& joint, const MeasuredMotion& motion,
                         const Eigen::Vector3d& gravity) {
  const PositionCurve& command =
      curve_of(motion.commanded, joint, "identify.no_commands", "commanded positions",
               "record the topic controller_state of its controller: doppel identify record");
  const PositionCurve& measured =
      curve_of(motion.measured, joint, "identify.no_positions", "positions", "record the topic joint_states");
  const int index = model.find_joint(joint);
  Span span = moving_span(command, model.joints[static_cast<std::size_t>(index)]);
  span.begin = std::max({span.begin, command.time.front(), measured.time.front()});
  span.end = std::min(span.end, measured.time.back());
  JointRecord out;
  for (std::size_t i = 0; i < command.time.size(); ++i) {
    if (command.time[i] < span.begin || command.time[i] > span.end) continue;
    out.command_time.push_back(command.time[i] - span.begin);
    out.command.push_back(command.position[i]);
  }
  MeasuredRobot robot(model, motion, span.begin, span.end);
  for (std::size_t i = 0; i < measured.time.size(); ++i) {
    if (measured.time[i] < span.begin || measured.time[i] > span.end) continue;
    const Load load = robot.load_of(index, measured.time[i], gravity);
    out.time.push_back(measured.time[i] - span.begin);
    out.position.push_back(measured.position[i]);
    out.load.push_back(load.load);
    out.inertia.push_back(load.inertia);
    if (out.time.size() % kYieldingPeriod == 1)
      out.yielding = std::max(out.yielding, robot.yielding_of(index, measured.time[i]));
  }
  if (const auto released = motion.released.find(joint);
      released != motion.released.end() && !out.time.empty())
    add_spans(released->second, span.begin, out);
  return out;
}

ServoValues start_values(const ModelJoint& joint, const ServoParameters& servo, const JointRecord& record) {
  constexpr double kSmallest = 1e-6;
  double fastest = kSmallest, inertia = kSmallest;
  for (std::size_t i = 0; i + 1 < record.command.size(); ++i) {
    const double time = record.command_time[i + 1] - record.command_time[i];
    fastest = std::max(fastest, std::abs(record.command[i + 1] - record.command[i]) / time);
  }
  for (const double one : record.inertia) inertia = std::max(inertia, one);
  ServoValues out{};
  const auto set = [&out](ServoQuantity quantity, double value) {
    out[static_cast<std::size_t>(quantity)] = value;
  };
  const double stiffness = std::max(servo.stiffness, kSmallest);
  const double effort = std::isfinite(servo.effort) ? servo.effort : kFullError * stiffness;
  set(ServoQuantity::delay, kDefaultDelay);
  set(ServoQuantity::velocity, std::isfinite(servo.velocity) ? servo.velocity : kFaster * fastest);
  set(ServoQuantity::effort, effort);
  set(ServoQuantity::stiffness, stiffness);
  set(ServoQuantity::damping, std::max(servo.damping, kSmallest));
  set(ServoQuantity::armature, 0.1 * inertia);
  set(ServoQuantity::viscous, joint.damping > 0 ? joint.damping : 0.02 * std::max(servo.damping, kSmallest));
  set(ServoQuantity::friction, joint.friction > 0 ? joint.friction : 0.01 * effort);
  set(ServoQuantity::breakaway, 0.005 * effort);
  set(ServoQuantity::stribeck, 0.1);
  set(ServoQuantity::load_factor, 0.05);
  set(ServoQuantity::backlash, 1e-3);
  return out;
}

}  // namespace doppel
