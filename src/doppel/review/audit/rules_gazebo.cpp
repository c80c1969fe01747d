// <gazebo> and <transmission>: what they refer to, and the names of plugins and materials.
#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/review/audit/detail/ros_rules.h"

namespace doppel::audit_rules {
namespace {

void check_references(const AuditInput& in, Findings& out) {
  Names known = link_names(in.robot);
  for (std::string& joint : joint_names(in.robot)) known.push_back(std::move(joint));
  for (const GazeboExtension& gazebo : in.robot.gazebo) {
    if (gazebo.reference.empty() || contains(known, gazebo.reference)) continue;
    out.add("gazebo.reference", fmt::format("<gazebo reference=\"{}\">", gazebo.reference), gazebo.source,
            fmt::format("the robot has neither a link nor a joint '{}'{}", gazebo.reference,
                        did_you_mean(gazebo.reference, known)),
            "correct the name, or remove the element");
  }
}

bool of_gazebo_classic(const std::string& library) {
  return library.starts_with("gazebo_ros_") || library.starts_with("gazebo_plugins");
}

void check_plugin_name(const GazeboPlugin& plugin, Findings& out) {
  const std::string subject = fmt::format("<gazebo> plugin '{}'", plugin.filename);
  const std::string library = library_name(plugin.filename);
  if (const GazeboControlPlugin* known = find_gazebo_control_plugin(plugin.filename)) {
    if (!known->present_file.empty()) {
      out.add("gazebo.old_plugin", subject, plugin.source,
              fmt::format("this library belongs to an earlier Gazebo; its current name is '{}'",
                          known->present_file),
              fmt::format("write filename=\"{}\" name=\"{}\"", known->present_file, known->present_class));
    } else if (plugin.name != known->class_name) {
      out.add("gazebo.plugin_class", subject, plugin.source,
              fmt::format("the library has no class '{}'", plugin.name),
              fmt::format("write name=\"{}\"", known->class_name));
    }
    return;
  }
  if (library.starts_with("ignition-gazebo")) {
    std::string present = "gz-sim" + library.substr(std::string("ignition-gazebo").size());
    out.add("gazebo.old_plugin", subject, plugin.source,
            fmt::format("this library belongs to Ignition Gazebo; its current name is '{}'", present),
            fmt::format("write filename=\"{}\", and gz::sim::systems in its name", present));
    return;
  }
  if (of_gazebo_classic(library)) {
    out.add("gazebo.old_plugin", Severity::note, subject, plugin.source,
            "this library belongs to Gazebo Classic, which reached end of life in January 2025; later Gazebo "
            "releases do not load it",
            "use the equivalent Gazebo system plugin");
    return;
  }
  for (const GazeboControlPlugin& candidate : gazebo_control_plugins()) {
    if (edit_distance(library, candidate.file) > 2) continue;
    const std::string_view meant = candidate.present_file.empty() ? candidate.file : candidate.present_file;
    out.add("gazebo.plugin_class", subject, plugin.source,
            fmt::format("no library is called '{}'; did you mean '{}'?", plugin.filename, meant),
            fmt::format("write filename=\"{}\"", meant));
    return;
  }
}

// A simulated component requires the <gazebo> plugin that runs it, and the plugin a component.
void check_pair(const AuditInput& in, Findings& out) {
  const GazeboPlugin* plugin = nullptr;
  for (const GazeboExtension& gazebo : in.robot.gazebo) {
    for (const GazeboPlugin& candidate : gazebo.plugins) {
      if (find_gazebo_control_plugin(candidate.filename) != nullptr) plugin = &candidate;
    }
  }
  const auto& hardware = in.robot.hardware;
  const auto simulated = std::find_if(hardware.begin(), hardware.end(), [](const HardwareDescription& h) {
    const SimulatorPlugin* known = find_simulator_plugin(h.plugin);
    return known != nullptr && known->needs_gazebo;
  });
  if (simulated != hardware.end() && plugin == nullptr) {
    out.add("gazebo.no_control_plugin", fmt::format("<ros2_control> '{}'", simulated->name),
            simulated->plugin_source,
            fmt::format("it uses '{}', which runs in Gazebo, but no <gazebo> element loads the plugin that "
                        "starts a controller manager there",
                        simulated->plugin),
            "add <gazebo><plugin filename=\"gz_ros2_control-system\" "
            "name=\"gz_ros2_control::GazeboSimROS2ControlPlugin\"> with its <parameters>");
  }
  const bool ros1 = plugin != nullptr && library_name(plugin->filename) == "gazebo_ros_control";
  if (plugin == nullptr || ros1 || simulated != hardware.end()) return;
  const std::string what =
      hardware.empty() ? "there is no <ros2_control> at all"
                       : fmt::format("'{}' uses '{}'", hardware.front().name, hardware.front().plugin);
  out.add("gazebo.no_simulated_hardware", fmt::format("<gazebo> plugin '{}'", plugin->filename),
          plugin->source,
          fmt::format("Gazebo starts a controller manager, but no component is simulated: {}", what),
          "use gz_ros2_control/GazeboSimSystem as the component's plugin in simulation");
}

// Ogre scripts of Gazebo Classic; one finding for all.
void check_materials(const AuditInput& in, Findings& out) {
  const GazeboExtension* first = nullptr;
  std::size_t count = 0;
  for (const GazeboExtension& gazebo : in.robot.gazebo) {
    if (!gazebo.material.starts_with("Gazebo/")) continue;
    if (first == nullptr) first = &gazebo;
    ++count;
  }
  if (first == nullptr) return;
  out.add("gazebo.material", fmt::format("<gazebo reference=\"{}\">", first->reference), first->source,
          fmt::format("'{}'{} is a material of Gazebo Classic; later Gazebo releases ignore it and show the "
                      "colour of the URDF's <material>, or grey",
                      first->material, count > 1 ? fmt::format(" (and {} more)", count - 1) : ""),
          "give the <visual> a <material> with a colour");
}

void check_transmissions(const AuditInput& in, Findings& out) {
  const Names joints = joint_names(in.robot);
  for (const Transmission& transmission : in.robot.transmissions) {
    for (const Transmission::Element& element : transmission.joints) {
      if (element.name.empty() || contains(joints, element.name)) continue;
      out.add("transmission.unknown_joint", fmt::format("transmission '{}'", transmission.name),
              element.source,
              fmt::format("the robot has no joint '{}'{}", element.name, did_you_mean(element.name, joints)),
              "use the joint name of the URDF, or remove the transmission");
    }
  }
}

}  // namespace

void check_gazebo(const AuditInput& in, Findings& out) {
  check_references(in, out);
  for (const GazeboExtension& gazebo : in.robot.gazebo) {
    for (const GazeboPlugin& plugin : gazebo.plugins) check_plugin_name(plugin, out);
  }
  check_pair(in, out);
  check_materials(in, out);
  check_transmissions(in, out);
}

}  // namespace doppel::audit_rules
