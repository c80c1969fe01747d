#include "doppel/control/controllers/detail/trajectory_message.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "doppel/base/core/names.h"
#include "doppel/control/controllers/detail/name_list.h"

namespace doppel::jtc {
namespace {

using Names = std::vector<std::string>;
using Message = trajectory_msgs::msg::JointTrajectory;
using Point = trajectory_msgs::msg::JointTrajectoryPoint;

struct NamedField {
  Field field;
  const char* name;
  std::vector<double> Point::*values;
};
constexpr NamedField kFields[] = {{Field::positions, "positions", &Point::positions},
                                  {Field::velocities, "velocities", &Point::velocities},
                                  {Field::accelerations, "accelerations", &Point::accelerations},
                                  {Field::effort, "effort", &Point::effort}};

std::string quoted(const Names& names) {
  return names.empty() ? "" : fmt::format("'{}'", fmt::join(names, "', '"));
}

std::string point_name(const Message& message, std::size_t index) {
  return fmt::format("point {} of {}", index + 1, message.points.size());
}

Status check_names(const Message& message, const MessageRules& rules) {
  if (message.joint_names.empty()) {
    return Status::refused(
        fmt::format("the trajectory lists no joints; write joint_names: [{}]", quoted(rules.joints)));
  }
  std::size_t named = 0;
  for (const std::string& name : message.joint_names) {
    if (contains(rules.ignored, name)) continue;
    ++named;
    if (!contains(rules.joints, name)) {
      return Status::refused(
          fmt::format("the trajectory lists joint '{}', which this controller does not have{}", name,
                      did_you_mean(name, rules.joints)));
    }
  }
  if (named == rules.joints.size() || (rules.allow_partial_joints && named > 0)) return {};
  Names missing;
  for (const std::string& joint : rules.joints) {
    if (!contains(message.joint_names, joint)) missing.push_back(joint);
  }
  return Status::refused(
      fmt::format("the trajectory lists {} joint{}, the controller has {}{}{}; list each of them once{}",
                  named, named == 1 ? "" : "s", rules.joints.size(), missing.empty() ? "" : ": missing ",
                  quoted(missing), missing.empty() ? "" : ", or set allow_partial_joints_goal"));
}

Status check_times(const Message& message, Time now) {
  Duration before{-1};
  for (std::size_t i = 0; i < message.points.size(); ++i) {
    const Duration time = from_msg(message.points[i].time_from_start);
    if (time <= before) {
      return Status::refused(
          i == 0
              ? fmt::format("time_from_start of {} is negative ({:g} s)", point_name(message, i),
                            to_seconds(time))
              : fmt::format(
                    "time_from_start must increase from point to point, but {} comes at {:g} s and the one "
                    "before it at {:g} s",
                    point_name(message, i), to_seconds(time), to_seconds(before)));
    }
    before = time;
  }
  const Time stamp = from_msg(message.header.stamp);
  if (stamp != Time{} && stamp + before < now) {
    return Status::refused(
        fmt::format("the trajectory ends in the past: its stamp is {:.3f} s, its last point {:.3f} s later, "
                    "and now is {:.3f} s; set the stamp to 0 to start immediately",
                    to_seconds(stamp), to_seconds(before), to_seconds(now)));
  }
  return {};
}

// Checks presence and lengths of one point's fields.
Status check_fields(const Message& message, std::size_t index, const MessageRules& rules) {
  const Point& point = message.points[index];
  const std::string where = point_name(message, index);
  if (point.positions.empty() && point.velocities.empty() && point.accelerations.empty()) {
    return Status::refused(fmt::format("{} has neither positions nor velocities nor accelerations", where));
  }
  if (point.positions.empty() && !rules.allow_integration) {
    return Status::refused(fmt::format(
        "{} has no positions; give one for each joint, or set allow_integration_in_goal_trajectories",
        where));
  }
  if (!point.effort.empty() && !rules.effort_commanded) {
    return Status::refused(
        fmt::format("{} has effort, but the controller does not command effort; omit it, or add effort to "
                    "command_interfaces",
                    where));
  }
  for (const NamedField& field : kFields) {
    const std::vector<double>& values = point.*field.values;
    if (values.empty() || values.size() == message.joint_names.size()) continue;
    return Status::refused(fmt::format("{} has {} {}, but the trajectory lists {} joints: {}", where,
                                       values.size(), field.name, message.joint_names.size(),
                                       quoted(message.joint_names)));
  }
  return {};
}

Status check_numbers(const Message& message, std::size_t index, const MessageRules& rules) {
  for (const NamedField& field : kFields) {
    const std::vector<double>& values = message.points[index].*field.values;
    for (std::size_t j = 0; j < values.size(); ++j) {
      if (std::isfinite(values[j]) || contains(rules.ignored, message.joint_names[j])) continue;
      return Status::refused(fmt::format("joint '{}' has {} among the {} of {}; send finite numbers",
                                         message.joint_names[j], values[j], field.name,
                                         point_name(message, index)));
    }
  }
  return {};
}

Status check_end(const Message& message, const MessageRules& rules) {
  if (rules.allow_nonzero_velocity_at_end) return {};
  const std::vector<double>& velocities = message.points.back().velocities;
  for (std::size_t j = 0; j < velocities.size(); ++j) {
    if (std::abs(velocities[j]) <= std::numeric_limits<float>::epsilon()) continue;
    if (contains(rules.ignored, message.joint_names[j])) continue;
    return Status::refused(
        fmt::format("joint '{}' still has velocity {:g} at the last point; end with 0, or set "
                    "allow_nonzero_velocity_at_trajectory_end",
                    message.joint_names[j], velocities[j]));
  }
  return {};
}

}  // namespace

Status check_message(const Message& message, const MessageRules& rules, Time now) {
  if (Status status = check_names(message, rules); !status) return status;
  if (message.points.empty()) {
    return Status::refused(
        "the trajectory has no points, and an empty one does not stop the robot; to stop it, cancel the goal "
        "or send its current position");
  }
  for (std::size_t i = 0; i < message.points.size(); ++i) {
    if (Status status = check_fields(message, i, rules); !status) return status;
    if (Status status = check_numbers(message, i, rules); !status) return status;
  }
  if (Status status = check_times(message, now); !status) return status;
  return check_end(message, rules);
}

std::vector<std::string> repeated_joints(const Message& message) {
  Names repeated;
  for (auto name = message.joint_names.begin(); name != message.joint_names.end(); ++name) {
    if (std::find(message.joint_names.begin(), name, *name) != name && !contains(repeated, *name)) {
      repeated.push_back(*name);
    }
  }
  return repeated;
}

std::unique_ptr<Trajectory> make_trajectory(const Message& message, const MessageRules& rules,
                                            std::span<const double> hold) {
  auto trajectory = std::make_unique<Trajectory>(rules.joints.size(), message.points.size());
  trajectory->set_stamp(from_msg(message.header.stamp));
  std::vector<std::ptrdiff_t> joint_of;  // of each column of the message
  for (const std::string& name : message.joint_names) {
    const auto found = std::find(rules.joints.begin(), rules.joints.end(), name);
    joint_of.push_back(found == rules.joints.end() ? -1 : found - rules.joints.begin());
  }
  for (std::size_t i = 0; i < message.points.size(); ++i) {
    trajectory->add_point(from_msg(message.points[i].time_from_start));
    for (const NamedField& field : kFields) {
      const std::vector<double>& values = message.points[i].*field.values;
      if (values.empty()) continue;
      const std::span<double> row = trajectory->give(i, field.field);
      if (field.field == Field::positions) std::copy(hold.begin(), hold.end(), row.begin());
      for (std::size_t column = 0; column < values.size(); ++column) {
        if (joint_of[column] >= 0) row[static_cast<std::size_t>(joint_of[column])] = values[column];
      }
    }
  }
  return trajectory;
}

}  // namespace doppel::jtc
