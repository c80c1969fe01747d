#include "doppel/description/gazebo/model_plugins.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/base/xml/element.h"
#include "doppel/base/yaml/yaml_text.h"
#include "doppel/description/gazebo/base_plugins.h"
#include "doppel/description/gazebo/plugin_values.h"
#include "doppel/description/gazebo/simulator_plugins.h"

namespace doppel {
namespace {

constexpr const char* kModelPluginRule = "up.model_plugin";
constexpr const char* kManagerHead = "controller_manager:\n  ros__parameters:\n    update_rate: 100\n";

std::string quoted_list(const std::vector<std::string>& texts) {
  std::vector<std::string> out;
  for (const std::string& text : texts) out.push_back(yaml_text(text));
  return fmt::format("[{}]", fmt::join(out, ", "));
}

class ModelMapper {
 public:
  ModelMapper(const RobotDescription& model, std::string world, Diagnostics& diagnostics)
      : model_(model), world_(std::move(world)), diagnostics_(diagnostics) {}

  std::optional<MappedModel> map() {
    declarations_ =
        "    joint_state_broadcaster:\n      type: joint_state_broadcaster/JointStateBroadcaster\n";
    if (const auto base = map_base_plugin(model_, PluginTopics::of_model, diagnostics_)) {
      declarations_ += base->declaration;
      sections_ += base->section;
      out_.joints = base->joints;
      any_ = true;
    }
    for (const GazeboExtension& extension : model_.gazebo) {
      for (const GazeboPlugin& plugin : extension.plugins) read(plugin);
    }
    if (!any_) return std::nullopt;
    out_.yaml = kManagerHead + declarations_ + sections_;
    return std::move(out_);
  }

 private:
  void read(const GazeboPlugin& plugin) {
    PluginValues values(parse_xml(plugin.xml, "<plugin>"));
    const auto joint_plugin = find_joint_plugin(plugin.filename, plugin.name);
    if (!joint_plugin && !drives_base(plugin.filename, plugin.name)) return;
    out_.name_space = valid_topic(is_classic(plugin) ? values.ros_namespace() : model_.name);
    if (out_.name_space.starts_with('/')) out_.name_space.erase(0, 1);
    if (!joint_plugin) return;
    if (values.flag({"use_actuator_msg"}, false)) {
      note(plugin, "is not mapped: it reads actuator_msgs/msg/Actuators", "leave out <use_actuator_msg>");
      return;
    }
    if (*joint_plugin == JointPlugin::states) return map_states(plugin, values);
    const std::vector<std::string> joints = joints_of(plugin, values, *joint_plugin);
    if (joints.empty()) return;
    if (*joint_plugin == JointPlugin::trajectory) {
      map_trajectory(plugin, values, joints);
    } else {
      map_scalar(plugin, values, joints, *joint_plugin == JointPlugin::position);
    }
  }

  // The named joints, or, of a trajectory, all that move; without those that another plugin commands.
  std::vector<std::string> joints_of(const GazeboPlugin& plugin, PluginValues& values, JointPlugin kind) {
    std::vector<std::string> known, joints = values.all({"joint_name"});
    for (const Joint& joint : model_.joints) {
      if (is_scalar(joint) && leader_of(model_, joint) == nullptr) known.push_back(joint.name);
    }
    if (joints.empty() && kind == JointPlugin::trajectory) joints = known;
    if (joints.empty()) note(plugin, "is not mapped: it names no joint", "write <joint_name>");
    std::erase_if(joints, [&](const std::string& name) {
      if (std::ranges::find(known, name) == known.end()) {
        note(plugin,
             fmt::format("names the joint '{}', which does not move or exist{}", name,
                         did_you_mean(name, known)),
             "write the name of a joint");
        return true;
      }
      if (std::ranges::find(out_.joints, name) == out_.joints.end()) return false;
      note(plugin, fmt::format("does not command '{}', which another plugin commands", name),
           "leave one of the plugins out");
      return true;
    });
    return joints;
  }

  void map_scalar(const GazeboPlugin& plugin, PluginValues& values, const std::vector<std::string>& joints,
                  bool position) {
    const std::string below = "/model/" + model_.name + "/";
    std::string topic = below + "joint/" + joints.front() +
                        (position ? "/" + values.text({"joint_index"}, "0") + "/cmd_pos" : "/cmd_vel");
    if (const std::string own = values.text({"sub_topic"}); !own.empty()) topic = below + own;
    const std::string read = valid_topic(absolute_topic("", values.text({"topic"}, topic)));
    const double initial = values.number({position ? "initial_position" : "initial_velocity"}).value_or(0.0);
    const std::string parameters =
        fmt::format("    joints: {}\n    interface_name: {}\n    initial_value: {:#.9g}\n",
                    quoted_list(joints), position ? "position" : "velocity", initial);
    add(plugin, values, position ? "joint_position_controller" : "joint_controller",
        "doppel/ScalarCommandController", {"-r", "~/command:=" + read}, parameters, joints,
        fmt::format("{}; it reads {} (std_msgs/msg/Float64)", fmt::join(joints, ", "), read));
  }

  void map_trajectory(const GazeboPlugin& plugin, PluginValues& values,
                      const std::vector<std::string>& joints) {
    const std::string topic = valid_topic(
        absolute_topic("", values.text({"topic"}, "/model/" + model_.name + "/joint_trajectory")));
    add(plugin, values, "joint_trajectory_controller",
        "joint_trajectory_controller/JointTrajectoryController", {"-r", "~/joint_trajectory:=" + topic},
        fmt::format("    joints: {}\n    command_interfaces: [position]\n    state_interfaces: [position, "
                    "velocity]\n",
                    quoted_list(joints)),
        joints, fmt::format("{}; it reads {}", fmt::join(joints, ", "), topic));
  }

  void map_states(const GazeboPlugin& plugin, PluginValues& values) {
    if (is_classic(plugin)) {
      any_ = true;
      return note(plugin,
                  "is mapped to the controller 'joint_state_broadcaster', which publishes joint_states", "");
    }
    const std::string usual = "/world/" + world_ + "/model/" + model_.name + "/joint_state";
    const std::string topic = valid_topic(absolute_topic("", values.text({"topic"}, usual)));
    std::string parameters = "    use_local_topics: true\n";
    const std::vector<std::string> joints = values.all({"joint_name"});
    if (!joints.empty()) {
      parameters +=
          fmt::format("    joints: {}\n    interfaces: [position, velocity, effort]\n", quoted_list(joints));
    }
    add(plugin, values, "joint_state_publisher", "joint_state_broadcaster/JointStateBroadcaster",
        {"-r", "~/joint_states:=" + topic}, parameters, {}, "it publishes " + topic);
  }

  void add(const GazeboPlugin& plugin, PluginValues& values, const std::string& kind, const std::string& type,
           const std::vector<std::string>& rules, const std::string& parameters,
           const std::vector<std::string>& joints, const std::string& what) {
    std::string name = kind;
    for (int i = 2; std::ranges::find(names_, name) != names_.end(); ++i)
      name = fmt::format("{}_{}", kind, i);
    names_.push_back(name);
    declarations_ +=
        fmt::format("    {}: {{type: {}, node_options_args: {}}}\n", name, type, quoted_list(rules));
    sections_ += fmt::format("{}:\n  ros__parameters:\n{}", name, parameters);
    out_.joints.insert(out_.joints.end(), joints.begin(), joints.end());
    any_ = true;
    const std::vector<std::string> unread = values.unread();
    values.report_wrong(kModelPluginRule, plugin.source, fmt::format("the plugin '{}'", plugin.filename),
                        diagnostics_);
    note(plugin,
         fmt::format("is mapped to the controller '{}' ({}): {}{}", name, type, what,
                     unread.empty() ? "" : fmt::format("; without effect: {}", fmt::join(unread, ", "))),
         "");
  }

  void note(const GazeboPlugin& plugin, const std::string& what, const std::string& fix) {
    diagnostics_.note(kModelPluginRule, plugin.source,
                      fmt::format("the plugin '{}' of '{}' {}", plugin.filename, model_.name, what), fix);
  }

  const RobotDescription& model_;
  const std::string world_;
  Diagnostics& diagnostics_;
  MappedModel out_;
  std::string declarations_, sections_;
  std::vector<std::string> names_;  // of controllers
  bool any_ = false;
};

}  // namespace

std::optional<MappedModel> map_model_plugins(const RobotDescription& model, const std::string& world,
                                             Diagnostics& diagnostics) {
  return ModelMapper(model, world, diagnostics).map();
}

void set_plugin_namespace(RobotDescription& model, const std::string& name_space) {
  for (GazeboExtension& extension : model.gazebo) {
    for (GazeboPlugin& plugin : extension.plugins) {
      if (!is_classic(plugin)) continue;
      XmlNode node = parse_xml(plugin.xml, "<plugin>");
      XmlNode ros = element("ros");
      std::erase_if(node.children, [&ros](XmlNode& child) {
        if (!child.is("ros")) return false;
        ros = std::move(child);
        return true;
      });
      std::erase_if(ros.children, [](const XmlNode& child) { return child.is("namespace"); });
      ros.children.push_back(text_element("namespace", name_space));
      node.children.push_back(std::move(ros));
      plugin.xml = to_xml(node);
    }
  }
}

}  // namespace doppel
