#include "doppel/description/gazebo/base_plugins.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "doppel/base/core/text.h"
#include "doppel/base/xml/xml.h"
#include "doppel/base/yaml/yaml_text.h"
#include "doppel/description/gazebo/plugin_values.h"
#include "doppel/description/gazebo/root_link.h"

namespace doppel {
namespace {

using Texts = std::vector<std::string>;

enum class BasePlugin { diff_drive, skid_steer, mecanum, ackermann, moves_body, other };

struct KnownPlugin {
  std::string_view name;  // part of the file's or class's name, in lower case
  BasePlugin kind;
};
// Longer names first: "ackermann" is in none of the others.
constexpr std::array<KnownPlugin, 13> kBasePlugins{{{"skid_steer_drive", BasePlugin::skid_steer},
                                                    {"gazebo_ros_diff_drive", BasePlugin::diff_drive},
                                                    {"diff-drive-system", BasePlugin::diff_drive},
                                                    {"diffdrive", BasePlugin::diff_drive},
                                                    {"mecanum-drive-system", BasePlugin::mecanum},
                                                    {"mecanumdrive", BasePlugin::mecanum},
                                                    {"ackermann-steering-system", BasePlugin::ackermann},
                                                    {"ackermannsteering", BasePlugin::ackermann},
                                                    {"planar_move", BasePlugin::moves_body},
                                                    {"velocity-control-system", BasePlugin::moves_body},
                                                    {"velocitycontrol", BasePlugin::moves_body},
                                                    {"tricycle_drive", BasePlugin::other},
                                                    {"ackermann_drive", BasePlugin::other}}};

std::optional<BasePlugin> kind_of(const GazeboPlugin& plugin) {
  for (const std::string& text : {lowered(plugin.filename), lowered(plugin.name)}) {
    for (const KnownPlugin& known : kBasePlugins) {
      if (text.find(known.name) != std::string::npos) return known.kind;
    }
  }
  return std::nullopt;
}

std::string yaml_list(const Texts& texts) {
  Texts quoted;
  for (const std::string& text : texts) quoted.push_back(yaml_text(text));
  return fmt::format("[{}]", fmt::join(quoted, ", "));
}

// The parameters of a section, and what the note says about them.
struct Mapping {
  MappedBase base;
  std::string input, output;  // the controller's own topics
  std::string text;           // "wheels ..."

  Mapping(const char* name, const char* type, const char* read, const char* published)
      : base{name, type, {}, {}, {}, {}}, input(read), output(published) {}
  void set(const std::string& name, const std::string& yaml) {
    base.section += fmt::format("    {}: {}\n", name, yaml);
  }
  void set(const std::string& name, double value) { set(name, fmt::format("{:#.9g}", value)); }
};

// A model's frame without the model's name, which the controllers put before it.
std::string without_model(const std::string& frame, const RobotDescription& robot) {
  return frame.starts_with(robot.name + "/") ? frame.substr(robot.name.size() + 1) : frame;
}

// Frames that the description does not have are replaced by its root.
void map_frames(PluginValues& values, const RobotDescription& robot, Mapping& out) {
  const std::string root = root_link_of(robot);
  const std::string base =
      without_model(values.text({"robot_base_frame", "robotBaseFrame", "child_frame_id"}, root), robot);
  const std::string odom = values.text({"odometry_frame", "odometryFrame", "frame_id"}, "odom");
  out.set("odom_frame_id", yaml_text(without_model(odom, robot)));
  out.set("base_frame_id", yaml_text(base == root ? base : root));
  const bool transform = values.flag({"publish_odom_tf", "publishOdomTF", "publishTf"}, true);
  out.set("enable_odom_tf", transform ? "true" : "false");
}

void map_covariances(Mapping& out) {
  for (const char* name : {"pose_covariance_diagonal", "twist_covariance_diagonal"})
    out.set(name, "[0.001, 0.001, 0.001, 0.001, 0.001, 0.01]");
}

void map_limits(PluginValues& values, Mapping& out) {
  const auto limit = [&](const char* parameter, std::initializer_list<std::string_view> names, double sign) {
    const auto value = values.number(names);
    if (value && *value * sign > 0) out.set(parameter, *value);
  };
  limit("linear.x.max_velocity", {"max_linear_velocity", "max_velocity"}, 1);
  limit("linear.x.min_velocity", {"min_linear_velocity", "min_velocity"}, -1);
  limit("linear.x.max_acceleration",
        {"max_linear_acceleration", "max_acceleration", "max_wheel_acceleration"}, 1);
  limit("linear.x.max_acceleration_reverse", {"min_linear_acceleration", "min_acceleration"}, -1);
  limit("angular.z.max_velocity", {"max_angular_velocity"}, 1);
  limit("angular.z.min_velocity", {"min_angular_velocity"}, -1);
  limit("angular.z.max_acceleration", {"max_angular_acceleration"}, 1);
  limit("angular.z.max_acceleration_reverse", {"min_angular_acceleration"}, -1);
}

Mapping map_diff_drive(PluginValues& values, const RobotDescription& robot, bool skid) {
  Mapping out("diff_drive", "diff_drive_controller/DiffDriveController", "~/cmd_vel_unstamped", "~/odom");
  Texts left = values.all({"left_joint", "leftJoint"}), right = values.all({"right_joint", "rightJoint"});
  if (skid && left.empty()) {
    left = values.all({"leftFrontJoint", "leftRearJoint"});
    right = values.all({"rightFrontJoint", "rightRearJoint"});
  }
  const double separation = values.positive({"wheel_separation", "wheelSeparation"}, skid ? 0.4 : 0.34);
  const double radius =
      values.positive({"wheel_radius"}, values.positive({"wheel_diameter", "wheelDiameter"}, 0.4) / 2);
  out.set("left_wheel_names", yaml_list(left));
  out.set("right_wheel_names", yaml_list(right));
  out.set("wheel_separation", separation);
  out.set("wheel_radius", radius);
  out.set("use_stamped_vel", "false");
  out.set("cmd_vel_timeout", 0.0);  // such plugins keep the last command
  out.set("publish_rate", values.positive({"odom_publish_frequency", "update_rate", "updateRate"}, 50.0));
  map_frames(values, robot, out);
  map_covariances(out);
  map_limits(values, out);
  out.base.joints = left;
  out.base.joints.insert(out.base.joints.end(), right.begin(), right.end());
  out.text = fmt::format("wheels {} and {}, separation {:g} m, radius {:g} m", fmt::join(left, ", "),
                         fmt::join(right, ", "), separation, radius);
  return out;
}

Mapping map_mecanum(PluginValues& values, const RobotDescription& robot) {
  Mapping out("mecanum_drive", "mecanum_drive_controller/MecanumDriveController", "~/reference",
              "~/odometry");
  const std::array<std::pair<const char*, std::string>, 4> wheels{
      {{"front_left", values.text({"front_left_joint"})},
       {"front_right", values.text({"front_right_joint"})},
       {"rear_right", values.text({"back_right_joint"})},
       {"rear_left", values.text({"back_left_joint"})}}};
  for (const auto& [wheel, joint] : wheels) {
    out.set(fmt::format("{}_wheel_command_joint_name", wheel), yaml_text(joint));
    out.base.joints.push_back(joint);
  }
  const double separation = values.positive({"wheel_separation"}, 1.0),
               wheelbase = values.positive({"wheelbase"}, 1.0);
  const double radius = values.positive({"wheel_radius"}, 0.2);
  out.set("kinematics.wheels_radius", radius);
  out.set("kinematics.sum_of_robot_center_projection_on_X_Y_axis", (separation + wheelbase) / 2);
  out.set("reference_timeout", 0.5);
  map_frames(values, robot, out);
  map_limits(values, out);
  out.text = fmt::format("wheels {}, separation {:g} m, wheelbase {:g} m, radius {:g} m",
                         fmt::join(out.base.joints, ", "), separation, wheelbase, radius);
  return out;
}

Mapping map_ackermann(PluginValues& values, const RobotDescription& robot) {
  Mapping out("ackermann_steering", "ackermann_steering_controller/AckermannSteeringController",
              "~/reference", "~/odometry");
  // The plugin lists all wheels of a side: the last ones are driven by default, and the first ones by the steering.
  const Texts left = values.all({"left_joint"}), right = values.all({"right_joint"});
  const Texts driven{right.empty() ? "" : right.back(), left.empty() ? "" : left.back()};
  const Texts steered{values.text({"right_steering_joint"}), values.text({"left_steering_joint"})};
  const double wheelbase = values.positive({"wheel_base"}, 1.0),
               track = values.positive({"wheel_separation"}, 1.0);
  const double radius = values.positive({"wheel_radius"}, 0.2);
  out.set("traction_joints_names", yaml_list(driven));
  out.set("steering_joints_names", yaml_list(steered));
  out.set("wheelbase", wheelbase);
  out.set("traction_track_width", track);
  out.set("steering_track_width", values.positive({"kingpin_width"}, track));
  out.set("traction_wheels_radius", radius);
  out.set("reference_timeout", 0.5);
  map_frames(values, robot, out);
  map_covariances(out);
  out.base.joints = driven;
  out.base.joints.insert(out.base.joints.end(), steered.begin(), steered.end());
  out.text = fmt::format("driven {}, steered {}, wheelbase {:g} m, track {:g} m, radius {:g} m",
                         fmt::join(driven, ", "), fmt::join(steered, ", "), wheelbase, track, radius);
  return out;
}

// Topics as the plugin has them: by <topic>, <command_topic> or a remapping.
struct BaseTopics {
  std::string input, output;
};
BaseTopics topics_of(const GazeboPlugin& plugin, PluginValues& values, const std::string& model) {
  const std::string below = "/model/" + model + "/";
  const bool gz = !model.empty() && !is_classic(plugin);
  std::string input =
      values.text({"command_topic", "commandTopic", "topic"}, gz ? below + "cmd_vel" : "cmd_vel");
  std::string output =
      values.text({"odometry_topic", "odometryTopic", "odom_topic"}, gz ? below + "odometry" : "odom");
  if (gz) {
    if (const std::string own = values.text({"sub_topic"}); !own.empty()) input = below + own;
    return {valid_topic(absolute_topic("", input)), valid_topic(absolute_topic("", output))};
  }
  if (!model.empty()) return {valid_topic(values.ros_name(input)), valid_topic(values.ros_name(output))};
  return {values.remapped(input), values.remapped(output)};
}

// With the declaration, in which the controller's topics are renamed.
void declare_base(const BaseTopics& topics, Mapping& out) {
  Texts rules{"-r", fmt::format("{}:={}", out.input, topics.input), "-r",
              fmt::format("{}:={}", out.output, topics.output)};
  if (out.output == "~/odometry") rules.insert(rules.end(), {"-r", "~/tf_odometry:=/tf"});
  out.base.declaration = fmt::format("    {}: {{type: {}, node_options_args: {}}}\n", out.base.name,
                                     out.base.type, yaml_list(rules));
  out.base.section = fmt::format("{}:\n  ros__parameters:\n{}", out.base.name, out.base.section);
}

void note_unmapped(const GazeboPlugin& plugin, const std::string& why, Diagnostics& diagnostics) {
  diagnostics.note(
      "up.base_plugin", plugin.source,
      fmt::format("the plugin '{}' drives the base in Gazebo and is not mapped to a controller: {}",
                  plugin.filename, why),
      "declare a controller of the base in a YAML file: --controllers FILE");
}

}  // namespace

std::string missing_joint(const RobotDescription& robot, const MappedBase& base) {
  for (const std::string& name : base.joints) {
    if (name.empty()) return "a joint that is not given";
    if (robot.find_joint(name) == nullptr) return fmt::format("'{}', which the robot does not have", name);
    const bool offered =
        robot.hardware.empty() ||
        std::ranges::any_of(robot.hardware, [&](const HardwareDescription& hardware) {
          return std::ranges::any_of(hardware.joints, [&](const HardwareJointDescription& joint) {
            return joint.name == name && std::ranges::any_of(joint.command_interfaces, [](const auto& i) {
                     return i.name == "velocity";
                   });
          });
        });
    if (!offered) return fmt::format("'{}', which has no velocity command in <ros2_control>", name);
  }
  return base.joints.empty() ? "wheels, and names none" : "";
}

bool is_classic(const GazeboPlugin& plugin) {
  return plugin.filename.find("gazebo_ros") != std::string::npos;
}

std::optional<MappedBase> map_base_plugin(const RobotDescription& robot, PluginTopics topics,
                                          Diagnostics& diagnostics) {
  std::optional<MappedBase> mapped;
  for (const GazeboExtension& extension : robot.gazebo) {
    for (const GazeboPlugin& plugin : extension.plugins) {
      const auto kind = kind_of(plugin);
      if (!kind) continue;
      if (mapped || *kind == BasePlugin::moves_body || *kind == BasePlugin::other) {
        note_unmapped(plugin,
                      mapped ? "another one is"
                      : *kind == BasePlugin::moves_body
                          ? "it moves the body and not its wheels, which nothing real does"
                          : "there is no such controller here yet",
                      diagnostics);
        continue;
      }
      PluginValues values(parse_xml(plugin.xml, "<plugin>"));
      Mapping made = *kind == BasePlugin::mecanum ? map_mecanum(values, robot)
                     : *kind == BasePlugin::ackermann
                         ? map_ackermann(values, robot)
                         : map_diff_drive(values, robot, *kind == BasePlugin::skid_steer);
      if (const std::string missing = missing_joint(robot, made.base); !missing.empty()) {
        note_unmapped(plugin, "it needs " + missing, diagnostics);
        continue;
      }
      values.report_wrong("up.base_plugin", plugin.source, fmt::format("the plugin '{}'", plugin.filename),
                          diagnostics);
      const BaseTopics names = topics_of(plugin, values, topics == PluginTopics::of_model ? robot.name : "");
      declare_base(names, made);
      const Texts unread = values.unread();
      diagnostics.note(
          "up.base_plugin", plugin.source,
          fmt::format(
              "the plugin '{}' is mapped to the controller '{}' ({}): {}; it reads {} and publishes {} "
              "and the transform of the base{}",
              plugin.filename, made.base.name, made.base.type, made.text, names.input, names.output,
              unread.empty() ? "" : fmt::format("; without effect: {}", fmt::join(unread, ", "))),
          "declare your own controllers with --controllers FILE");
      mapped = std::move(made.base);
    }
  }
  return mapped;
}

}  // namespace doppel
