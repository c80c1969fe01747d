#include <algorithm>
#include <array>
#include <cmath>
#include <variant>

#include "doppel/scenario/resolve/detail/ros1_mapping.h"

namespace doppel {
namespace {

using Names = std::vector<std::string>;

// As in ROS 1: from the origins of the joints in their parents.
std::optional<double> ros1_separation(const RobotDescription& robot, const std::string& a,
                                      const std::string& b) {
  const Joint *first = robot.find_joint(a), *second = robot.find_joint(b);
  if (first == nullptr || second == nullptr) return std::nullopt;
  return (first->origin.xyz - second->origin.xyz).norm();
}

std::optional<double> ros1_radius(const RobotDescription& robot, const std::string& joint) {
  const Joint* axle = robot.find_joint(joint);
  const Link* wheel = axle == nullptr ? nullptr : robot.find_link(axle->child);
  if (wheel == nullptr) return std::nullopt;
  for (const Collision& collision : wheel->collisions) {
    if (const auto* cylinder = std::get_if<Cylinder>(&collision.geometry)) return cylinder->radius;
    if (const auto* sphere = std::get_if<Sphere>(&collision.geometry)) return sphere->radius;
  }
  return std::nullopt;
}

std::string first_of(const Names& names) {
  return names.empty() ? "" : names.front();
}

// In ROS 1 a limit holds only where its kind is switched on, for either direction of motion.
void map_ros1_limits(Ros1Mapping& out, const std::string& component) {
  for (const char* kind : {"velocity", "acceleration", "jerk"}) {
    const std::string most = component + ".max_" + kind, least = component + ".min_" + kind;
    const bool on = out.flag(component + ".has_" + kind + "_limits", false);
    const auto upper = out.number(most), lower = out.number(least);
    if (!on || !upper) continue;
    out.set(most, *upper, most);
    if (!lower) continue;
    if (std::string_view(kind) != "acceleration") {
      out.set(least, *lower, least);
    } else {
      out.set(component + ".max_deceleration", *lower, least);
      out.set(component + ".max_acceleration_reverse", *lower, least);
      out.set(component + ".max_deceleration_reverse", *upper, most);
    }
  }
}

// Frames of ROS 1 may begin with a slash, which its tf2 removed.
void map_ros1_odometry(Ros1Mapping& out) {
  for (const char* frame : {"base_frame_id", "odom_frame_id"}) {
    const Names written = out.names(frame);
    if (written.empty()) continue;
    const std::string& id = written.front();
    out.set(frame, id.starts_with('/') ? id.substr(1) : id, frame);
  }
  out.copy("enable_odom_tf");
  out.copy("pose_covariance_diagonal");
  out.copy("twist_covariance_diagonal");
}

// A whole number; some files of ROS 1 have others.
void map_ros1_window(Ros1Mapping& out) {
  constexpr const char* kWindow = "velocity_rolling_window_size";
  if (const auto size = out.number(kWindow))
    out.set(kWindow, static_cast<std::int64_t>(std::max(1.0, std::round(*size))), kWindow);
}

// A controller with ~/reference takes its commands from the topic that it has in ROS 1.
void keep_ros1_topics(Ros1Mapping& out) {
  for (const auto& [from, to] : {std::pair{"~/reference", "cmd_vel"}, std::pair{"~/odometry", "odom"}})
    out.remaps.insert(out.remaps.end(), {"-r", std::string(from) + ":=" + out.name + "/" + to});
  out.remaps.insert(out.remaps.end(), {"-r", "~/tf_odometry:=/tf"});
  out.copy("cmd_vel_timeout", "reference_timeout");
  if (out.place_of("cmd_vel_timeout").line == 0) out.set("reference_timeout", 0.5, "");
}

void map_ros1_diff_drive(Ros1Mapping& out) {
  out.type = "diff_drive_controller/DiffDriveController";
  const Names left = out.names("left_wheel"), right = out.names("right_wheel");
  out.set("left_wheel_names", left, "left_wheel");
  out.set("right_wheel_names", right, "right_wheel");
  out.set("wheel_separation",
          out.length("wheel_separation", ros1_separation(out.robot, first_of(left), first_of(right)),
                     "wheel separation"),
          "wheel_separation");
  out.set("wheel_radius", out.length("wheel_radius", ros1_radius(out.robot, first_of(left)), "wheel radius"),
          "wheel_radius");
  for (const char* same : {"wheel_separation_multiplier", "left_wheel_radius_multiplier",
                           "right_wheel_radius_multiplier", "publish_rate", "cmd_vel_timeout", "open_loop"})
    out.copy(same);
  for (const char* side : {"left_wheel_radius_multiplier", "right_wheel_radius_multiplier"})
    out.copy("wheel_radius_multiplier", side);
  out.copy("publish_cmd", "publish_limited_velocity");
  map_ros1_window(out);
  map_ros1_odometry(out);
  map_ros1_limits(out, "linear.x");
  map_ros1_limits(out, "angular.z");
}

void map_ros1_mecanum(Ros1Mapping& out) {
  out.type = "mecanum_drive_controller/MecanumDriveController";
  constexpr std::array<std::pair<const char*, const char*>, 4> kWheels{{{"front_left", "front_left"},
                                                                        {"front_right", "front_right"},
                                                                        {"back_right", "rear_right"},
                                                                        {"back_left", "rear_left"}}};
  std::array<std::string, 4> joints;
  for (std::size_t i = 0; i < kWheels.size(); ++i) {
    const std::string key = std::string(kWheels[i].first) + "_wheel_joint";
    joints[i] = first_of(out.names(key));
    out.set(std::string(kWheels[i].second) + "_wheel_command_joint_name", joints[i], key);
  }
  const Joint *front = out.robot.find_joint(joints[0]), *rear = out.robot.find_joint(joints[2]);
  std::optional<double> x, y;
  if (front != nullptr && rear != nullptr) {
    x = std::abs(front->origin.xyz.x() - rear->origin.xyz.x());
    y = std::abs(front->origin.xyz.y() - rear->origin.xyz.y());
  }
  const double along = out.length("wheel_separation_x", x, "wheel separation along x"),
               across = out.length("wheel_separation_y", y, "wheel separation along y"),
               radius = out.length("wheel_radius", ros1_radius(out.robot, joints[0]), "wheel radius");
  out.set("kinematics.sum_of_robot_center_projection_on_X_Y_axis",
          (along + across) / 2 * out.number("wheel_separation_multiplier").value_or(1.0),
          "wheel_separation_x");
  out.set("kinematics.wheels_radius", radius * out.number("wheel_radius_multiplier").value_or(1.0),
          "wheel_radius");
  keep_ros1_topics(out);
  map_ros1_odometry(out);
  for (const char* component : {"linear.x", "linear.y", "angular.z"}) map_ros1_limits(out, component);
}

// One virtual wheel is driven, and one is steered.
void map_ros1_steering(Ros1Mapping& out) {
  out.type = "bicycle_steering_controller/BicycleSteeringController";
  const Names rear = out.names("rear_wheel"), front = out.names("front_steer");
  out.set("traction_joints_names", rear, "rear_wheel");
  out.set("steering_joints_names", front, "front_steer");
  const double wheelbase = out.length(
      "wheel_separation_h", ros1_separation(out.robot, first_of(rear), first_of(front)), "wheelbase");
  const double radius = out.length("wheel_radius", ros1_radius(out.robot, first_of(rear)), "wheel radius");
  out.set("wheelbase", wheelbase * out.number("wheel_separation_h_multiplier").value_or(1.0),
          "wheel_separation_h");
  out.set("traction_wheel_radius", radius * out.number("wheel_radius_multiplier").value_or(1.0),
          "wheel_radius");
  out.copy("open_loop");
  map_ros1_window(out);
  keep_ros1_topics(out);
  map_ros1_odometry(out);
}

void map_ros1_group(Ros1Mapping& out, std::string type) {
  out.type = std::move(type);
  const bool one = out.place_of("joint").line != 0;
  const char* key = one ? "joint" : "joints";
  out.set("joints", out.names(key), key);
}

void map_ros1_trajectories(Ros1Mapping& out, const std::string& quantity) {
  out.type = "joint_trajectory_controller/JointTrajectoryController";
  out.set("joints", out.names("joints"), "joints");
  out.set("command_interfaces", Names{quantity}, "");
  out.set("state_interfaces", Names{"position", "velocity"}, "");
  out.copy("state_publish_rate");
  out.copy("action_monitor_rate");
  out.copy("allow_partial_joints_goal");
  out.copy("constraints.goal_time");
  out.copy("constraints.stopped_velocity_tolerance");
  for (const std::string& joint : out.names("joints")) {
    for (const char* kind : {"trajectory", "goal"}) out.copy("constraints." + joint + "." + kind);
  }
}

}  // namespace

void map_ros1_controller(std::string_view type, Ros1Mapping& out) {
  if (type == "diff_drive_controller/DiffDriveController") return map_ros1_diff_drive(out);
  if (type == "mecanum_drive_controller/MecanumDriveController") return map_ros1_mecanum(out);
  if (type == "ackermann_steering_controller/AckermannSteeringController" ||
      type == "steer_drive_controller/SteerDriveController")
    return map_ros1_steering(out);
  if (type == "joint_state_controller/JointStateController") {
    out.type = "joint_state_broadcaster/JointStateBroadcaster";
    return out.drop("publish_rate");
  }
  for (const char* quantity : {"position", "velocity"}) {
    const std::string package = std::string(quantity) + "_controllers/";
    if (type == package + "JointTrajectoryController") return map_ros1_trajectories(out, quantity);
    const std::string capital = quantity == std::string_view("position") ? "Position" : "Velocity";
    for (const std::string& kind :
         {"Joint" + capital + "Controller", "JointGroup" + capital + "Controller"}) {
      if (type == package + kind) return map_ros1_group(out, package + "JointGroup" + capital + "Controller");
    }
  }
}

}  // namespace doppel
