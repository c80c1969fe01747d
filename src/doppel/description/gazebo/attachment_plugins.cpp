#include "doppel/description/gazebo/attachment_plugins.h"

#include <fmt/format.h>

#include "doppel/base/core/names.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/gazebo/plugin_values.h"
#include "doppel/description/gazebo/simulator_plugins.h"

namespace doppel {
namespace {

constexpr const char* kAttachmentRule = "up.attachment";

class PluginReader {
 public:
  PluginReader(const RobotDescription& description, const std::string& name, Diagnostics& diagnostics)
      : description_(description), name_(name), diagnostics_(diagnostics) {}

  void read(const GazeboPlugin& plugin) {
    const auto kind = find_attachment_plugin(plugin.filename, plugin.name);
    if (!kind) return;
    PluginValues values(parse_xml(plugin.xml, "<plugin>"));
    if (*kind == AttachmentPlugin::detachable_joint) {
      read_joint(values, plugin.source);
    } else {
      read_vacuum(values, plugin.source);
    }
    values.report_wrong(kAttachmentRule, plugin.source, fmt::format("the plugin '{}'", plugin.filename),
                        diagnostics_);
  }

  void read_gripper(const XmlNode& element, const SourceLocation& source) {
    const XmlNode* const check = element.first("grasp_check");
    if (check == nullptr) return;
    PluginValues values(element), counts(*check);
    GripperCheck out;
    out.palm = values.text({"palm_link"});
    out.links = values.all({"gripper_link"});
    out.attach_steps = counts.positive_count({"attach_steps"}, out.attach_steps);
    out.detach_steps = counts.positive_count({"detach_steps"}, out.detach_steps);
    out.min_contacts = counts.positive_count({"min_contact_count"}, out.min_contacts);
    counts.report_wrong(kAttachmentRule, source, "<grasp_check>", diagnostics_);
    bool known = has_link(out.palm, "<palm_link>", source);
    for (const std::string& link : out.links) known = known && has_link(link, "<gripper_link>", source);
    if (known) found.grippers.push_back(std::move(out));
  }

  AttachmentPlugins found;

 private:
  void read_joint(PluginValues& values, const SourceLocation& source) {
    const std::string below = "/model/" + name_ + "/detachable_joint/";
    DetachableJoint out;
    out.parent_link = values.text({"parent_link"});
    out.child_model = values.text({"child_model"});
    out.child_link = values.text({"child_link"});
    const std::string former = values.text({"topic"}, below + "detach");
    out.detach_topic = absolute_topic("", values.text({"detach_topic"}, former));
    out.attach_topic = absolute_topic("", values.text({"attach_topic"}, below + "attach"));
    out.output_topic = absolute_topic("", values.text({"output_topic"}, below + "state"));
    if (out.child_model == "__model__") out.child_model = name_;
    if (has_link(out.parent_link, "<parent_link>", source)) found.joints.push_back(std::move(out));
  }

  void read_vacuum(PluginValues& values, const SourceLocation& source) {
    VacuumGripper out;
    out.link = values.text({"link_name", "bodyName"});
    out.reach = values.positive({"max_distance"}, out.reach);
    if (values.element().first("bodyName") != nullptr) {  // of ROS 1
      const std::string name_space = values.text({"robotNamespace"});
      out.on_service = absolute_topic(name_space, "on");
      out.off_service = absolute_topic(name_space, "off");
      out.grasping_topic = absolute_topic(name_space, values.text({"topicName"}, "grasping"));
    } else {
      out.switch_service = values.ros_name("switch");
      out.grasping_topic = values.ros_name("grasping");
    }
    if (has_link(out.link, "<link_name>", source)) found.vacuums.push_back(std::move(out));
  }

  bool has_link(const std::string& link, const char* element, const SourceLocation& source) {
    std::vector<std::string> names;
    for (const Link& other : description_.links) {
      if (other.name == link) return true;
      names.push_back(other.name);
    }
    diagnostics_.warning(kAttachmentRule, source,
                         fmt::format("{} is '{}', which is no link of '{}'; nothing is attached by it{}",
                                     element, link, name_, did_you_mean(link, names)),
                         "write the name of a link");
    return false;
  }

  const RobotDescription& description_;
  const std::string& name_;
  Diagnostics& diagnostics_;
};

}  // namespace

AttachmentPlugins attachment_plugins_of(const RobotDescription& description, const std::string& name,
                                        Diagnostics& diagnostics) {
  PluginReader reader(description, name, diagnostics);
  for (const GazeboExtension& extension : description.gazebo) {
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
