#include "doppel/twin/detail/attachment_plugins.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>

#include "doppel/core/names.h"
#include "doppel/xml/xml.h"

namespace doppel {
namespace {

constexpr const char* kAttachmentRule = "up.attachment";

bool names_plugin(const GazeboPlugin& plugin, std::initializer_list<std::string_view> parts) {
  return std::ranges::any_of(parts, [&](std::string_view part) {
    return plugin.filename.find(part) != std::string::npos || plugin.name.find(part) != std::string::npos;
  });
}

std::string text_of(const XmlNode& element, std::initializer_list<std::string_view> names,
                    std::string otherwise = "") {
  for (const std::string_view name : names) {
    const XmlNode* const child = element.first(name);
    if (child != nullptr && !child->content().empty()) return child->content();
  }
  return otherwise;
}

template <typename Number>
Number number_of(const XmlNode& element, const char* name, Number otherwise) {
  const std::string text = text_of(element, {name});
  Number value{};
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  return problem == std::errc() && end != text.data() && value > 0 ? value : otherwise;
}

std::string absolute(const std::string& name_space, const std::string& topic) {
  if (topic.starts_with('/')) return topic;
  return name_space.empty() || name_space == "/" ? "/" + topic
         : name_space.starts_with('/')           ? name_space + "/" + topic
                                                 : "/" + name_space + "/" + topic;
}

// <ros><namespace>, <ros><remapping>from:=to</remapping>
std::string ros_name(const XmlNode& plugin, const std::string& name) {
  const XmlNode* const ros = plugin.first("ros");
  if (ros == nullptr) return "/" + name;
  std::string remapped = name;
  for (const XmlNode& child : ros->children) {
    const std::string rule = child.is("remapping") ? child.content() : "";
    if (rule.starts_with(name + ":=")) remapped = rule.substr(name.size() + 2);
  }
  return absolute(text_of(*ros, {"namespace"}), remapped);
}

class PluginReader {
 public:
  PluginReader(const ModelInstance& instance, Diagnostics& diagnostics)
      : instance_(instance), diagnostics_(diagnostics) {}

  void read(const GazeboPlugin& plugin) {
    const bool joint = names_plugin(plugin, {"detachable-joint-system", "systems::DetachableJoint"});
    if (!joint && !names_plugin(plugin, {"gazebo_ros_vacuum_gripper"})) return;
    const XmlNode element = parse_xml(plugin.xml, "<plugin>");
    if (joint) {
      read_joint(element, plugin);
    } else {
      read_vacuum(element, plugin);
    }
  }

  void read_gripper(const XmlNode& element, const SourceLocation& source) {
    const XmlNode* const check = element.first("grasp_check");
    if (check == nullptr) return;
    GripperCheck out;
    out.palm = text_of(element, {"palm_link"});
    for (const XmlNode& child : element.children) {
      if (child.is("gripper_link")) out.links.push_back(child.content());
    }
    out.attach_steps = number_of(*check, "attach_steps", out.attach_steps);
    out.detach_steps = number_of(*check, "detach_steps", out.detach_steps);
    out.min_contacts = number_of(*check, "min_contact_count", out.min_contacts);
    bool known = has_link(out.palm, "<palm_link>", source);
    for (const std::string& link : out.links) known = known && has_link(link, "<gripper_link>", source);
    if (known) found.grippers.push_back(std::move(out));
  }

  AttachmentPlugins found;

 private:
  void read_joint(const XmlNode& element, const GazeboPlugin& plugin) {
    const std::string below = "/model/" + instance_.name + "/detachable_joint/";
    DetachableJoint out;
    out.parent_link = text_of(element, {"parent_link"});
    out.child_model = text_of(element, {"child_model"});
    out.child_link = text_of(element, {"child_link"});
    out.detach_topic = absolute("", text_of(element, {"detach_topic", "topic"}, below + "detach"));
    out.attach_topic = absolute("", text_of(element, {"attach_topic"}, below + "attach"));
    out.output_topic = absolute("", text_of(element, {"output_topic"}, below + "state"));
    if (out.child_model == "__model__") out.child_model = instance_.name;
    if (has_link(out.parent_link, "<parent_link>", plugin.source)) found.joints.push_back(std::move(out));
  }

  void read_vacuum(const XmlNode& element, const GazeboPlugin& plugin) {
    VacuumGripper out;
    out.link = text_of(element, {"link_name", "bodyName"});
    out.reach = number_of(element, "max_distance", out.reach);
    if (element.first("bodyName") != nullptr) {  // of ROS 1
      const std::string name_space = text_of(element, {"robotNamespace"});
      out.on_service = absolute(name_space, "on");
      out.off_service = absolute(name_space, "off");
      out.grasping_topic = absolute(name_space, text_of(element, {"topicName"}, "grasping"));
    } else {
      out.switch_service = ros_name(element, "switch");
      out.grasping_topic = ros_name(element, "grasping");
    }
    if (has_link(out.link, "<link_name>", plugin.source)) found.vacuums.push_back(std::move(out));
  }

  bool has_link(const std::string& link, const char* element, const SourceLocation& source) {
    if (instance_.model->find_link(link) >= 0) return true;
    std::vector<std::string> names;
    for (const ModelLink& of : instance_.model->links) names.push_back(of.name);
    diagnostics_.warning(kAttachmentRule, source,
                         fmt::format("{} is '{}', which is no link of '{}'; nothing is attached by it{}",
                                     element, link, instance_.name, did_you_mean(link, names)),
                         "write the name of a link");
    return false;
  }

  const ModelInstance& instance_;
  Diagnostics& diagnostics_;
};

}  // namespace

AttachmentPlugins attachment_plugins_of(const ModelInstance& instance, Diagnostics& diagnostics) {
  PluginReader reader(instance, diagnostics);
  for (const GazeboExtension& extension : instance.description->gazebo) {
    for (const GazeboPlugin& plugin : extension.plugins) reader.read(plugin);
    if (extension.xml.find("<gripper") == std::string::npos) continue;
    const XmlNode element = parse_xml(extension.xml, "<gazebo>");
    for (const XmlNode& child : element.children) {
      if (child.is("gripper")) reader.read_gripper(child, extension.source);
    }
  }
  return std::move(reader.found);
}

}  // namespace doppel
