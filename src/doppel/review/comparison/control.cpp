#include <algorithm>
#include <map>
#include <set>

#include "doppel/review/comparison/detail/comparison.h"

namespace doppel::comparison {
namespace {

std::string interfaces_text(const std::vector<HardwareInterfaceDescription>& interfaces) {
  std::set<std::string> names;
  for (const auto& i : interfaces) names.insert(i.name);
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

using Parts = std::map<std::string, const HardwareJointDescription*>;

Parts parts_of(const HardwareDescription& hardware) {
  Parts out;
  for (const auto* list : {&hardware.joints, &hardware.sensors, &hardware.gpios}) {
    for (const auto& part : *list) out.emplace(part.name, &part);
  }
  return out;
}

std::string names_of(const Parts& parts) {
  std::string out;
  for (const auto& [name, part] : parts) out += (out.empty() ? "" : ", ") + name;
  return out.empty() ? "none" : out;
}

void compare_hardware(const HardwareDescription& a, const HardwareDescription& b, std::vector<Change>& out) {
  Changes changes(out, "ros2_control", b.name);
  changes.text("plugin", a.plugin, b.plugin);
  changes.text("type", a.type, b.type);
  const Parts from = parts_of(a), to = parts_of(b);
  if (names_of(from) != names_of(to)) changes.add("joints", names_of(from), names_of(to));
  for (const auto& [name, part] : to) {
    const auto before = from.find(name);
    if (before == from.end()) continue;
    const auto aspect = [&name = name](const char* what) { return fmt::format("{} {}", name, what); };
    changes.text(aspect("commands").c_str(), interfaces_text(before->second->command_interfaces),
                 interfaces_text(part->command_interfaces));
    changes.text(aspect("states").c_str(), interfaces_text(before->second->state_interfaces),
                 interfaces_text(part->state_interfaces));
  }
}

std::multiset<std::string> plugins_of(const RobotDescription& robot) {
  std::multiset<std::string> out;
  for (const GazeboExtension& gazebo : robot.gazebo) {
    for (const GazeboPlugin& plugin : gazebo.plugins)
      out.insert(gazebo.reference.empty() ? plugin.name : plugin.name + " on " + gazebo.reference);
  }
  return out;
}

}  // namespace

void compare_control(const RobotDescription& a, const RobotDescription& b, std::vector<Change>& out) {
  const auto find = [](const RobotDescription& robot, const std::string& name) -> const HardwareDescription* {
    const auto at = std::find_if(robot.hardware.begin(), robot.hardware.end(),
                                 [&name](const auto& hardware) { return hardware.name == name; });
    return at == robot.hardware.end() ? nullptr : &*at;
  };
  for (const HardwareDescription& hardware : b.hardware) {
    if (const auto* before = find(a, hardware.name)) {
      compare_hardware(*before, hardware, out);
    } else {
      out.push_back({Change::Kind::added, "ros2_control", hardware.name, "", "",
                     fmt::format("{} with {} joints", hardware.plugin, hardware.joints.size()), ""});
    }
  }
  for (const HardwareDescription& hardware : a.hardware) {
    if (find(b, hardware.name) == nullptr)
      out.push_back({Change::Kind::removed, "ros2_control", hardware.name, "", hardware.plugin, "", ""});
  }
  const auto from = plugins_of(a), to = plugins_of(b);
  for (const std::string& plugin : to) {
    if (!from.contains(plugin)) out.push_back({Change::Kind::added, "gazebo plugin", plugin, "", "", "", ""});
  }
  for (const std::string& plugin : from) {
    if (!to.contains(plugin)) out.push_back({Change::Kind::removed, "gazebo plugin", plugin, "", "", "", ""});
  }
}

}  // namespace doppel::comparison
