// The components of <ros2_control> themselves: their type and their plugin.
#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/review/audit/detail/ros_rules.h"

namespace doppel::audit_rules {
namespace {

std::string subject_of(const HardwareDescription& hardware) {
  return fmt::format("<ros2_control> '{}'", hardware.name);
}

void check_type(const HardwareDescription& hardware, Findings& out) {
  static const Names kTypes{"system", "actuator", "sensor"};
  if (contains(kTypes, hardware.type)) return;
  if (hardware.type.empty()) {
    out.add("ros2_control.type", subject_of(hardware), hardware.source, "it has no type",
            "write type=\"system\"");
    return;
  }
  out.add("ros2_control.type", subject_of(hardware), hardware.source,
          fmt::format("unknown type '{}'{}", hardware.type, did_you_mean(hardware.type, kTypes)),
          "write type=\"system\", \"actuator\" or \"sensor\"");
}

void check_plugin(const HardwareDescription& hardware, Findings& out) {
  if (hardware.plugin.empty()) {
    out.add(
        "ros2_control.no_plugin", subject_of(hardware), hardware.source,
        "it has no plugin, so nothing drives its joints",
        "write <hardware><plugin>gz_ros2_control/GazeboSimSystem</plugin></hardware>, or the driver's name");
    return;
  }
  if (const SimulatorPlugin* known = find_simulator_plugin(hardware.plugin)) {
    if (known->present.empty()) return;
    out.add("ros2_control.old_plugin", subject_of(hardware), hardware.plugin_source,
            fmt::format("'{}' is the plugin of {}; its current name is '{}'", hardware.plugin, known->whose,
                        known->present),
            fmt::format("write <plugin>{}</plugin>", known->present));
    return;
  }
  Names names;
  for (const SimulatorPlugin& plugin : simulator_plugins()) names.emplace_back(plugin.name);
  const auto near = std::find_if(names.begin(), names.end(), [&](const std::string& name) {
    return edit_distance(hardware.plugin, name) <= 3;
  });
  if (near != names.end()) {
    const std::string_view present = find_simulator_plugin(*near)->present;
    const std::string meant = present.empty() ? *near : std::string(present);
    out.add("ros2_control.plugin_name", subject_of(hardware), hardware.plugin_source,
            fmt::format("no plugin is called '{}'; did you mean '{}'?", hardware.plugin, meant),
            fmt::format("write <plugin>{}</plugin>", meant));
  } else if (hardware.plugin.find('/') == std::string::npos &&
             hardware.plugin.find("::") == std::string::npos) {
    out.add("ros2_control.plugin_name", Severity::note, subject_of(hardware), hardware.plugin_source,
            fmt::format("'{}' does not have the usual form PACKAGE/CLASS", hardware.plugin),
            "write the name that the plugin's package exports");
  }
}

// Descriptions that are prepared for ros2_control (with an empty include, as exporters write it) and lack it.
void check_presence(const AuditInput& in, Findings& out) {
  if (!in.robot.hardware.empty()) return;
  const auto prepared =
      std::find_if(in.expanded.files.begin(), in.expanded.files.end(), [](const auto& file) {
        return file.filename().string().find("ros2_control") != std::string::npos ||
               file.filename().string().find("ros2control") != std::string::npos;
      });
  const bool can_move = std::any_of(in.robot.joints.begin(), in.robot.joints.end(), driven_kind);
  if (prepared == in.expanded.files.end() || !can_move) return;
  out.add("ros2_control.missing", "the robot", make_location(prepared->string(), 1, 1),
          "this file is included but contains no active <ros2_control>, so no controller can move the robot",
          "write a <ros2_control> block with the driven joints, or select one by the file's arguments");
}

}  // namespace

void check_hardware(const AuditInput& in, Findings& out) {
  for (const HardwareDescription& hardware : in.robot.hardware) {
    check_type(hardware, out);
    check_plugin(hardware, out);
  }
  check_presence(in, out);
}

}  // namespace doppel::audit_rules
