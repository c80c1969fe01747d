#include "doppel/scenario/resolve/controllers_file.h"

#include <algorithm>
#include <array>

#include "doppel/control/hardware/hardware.h"
#include "doppel/scenario/resolve/ros1_controllers.h"

namespace doppel {
namespace {

constexpr std::string_view kDiffDrive = "diff_drive_controller/DiffDriveController";

std::string rooted(const std::string& node) {
  return node.starts_with('/') ? node : "/" + node;
}

const ParameterOverride* find(const ParameterOverrides& all, std::string_view name) {
  for (const ParameterOverride& o : all.all()) {
    if (o.name == name) return &o;
  }
  return nullptr;
}

// Keys below controller_manager that are groups of its own parameters and no controllers.
bool own_group(std::string_view name) {
  constexpr std::string_view kGroups[] = {"diagnostics", "hardware_components_initial_state",
                                          "overruns",    "defaults",
                                          "statistics",  "qos_overrides"};
  return std::find(std::begin(kGroups), std::end(kGroups), name) != std::end(kGroups);
}

void read_declarations(const ParameterFile& file, const ParameterOverrides& manager, ControllersFile& out) {
  for (const ParameterOverride& o : manager.all()) {
    const std::size_t dot = o.name.find('.');
    if (dot == std::string::npos) continue;
    const std::string name = o.name.substr(0, dot), key = o.name.substr(dot + 1);
    if (own_group(name)) continue;
    auto known = std::find_if(out.controllers.begin(), out.controllers.end(),
                              [&](const DeclaredController& c) { return c.name == name; });
    if (known == out.controllers.end()) {
      out.controllers.push_back({name, "", o.source, file.overrides_for("/" + name), false});
      known = std::prev(out.controllers.end());
    }
    if (key == "type") {
      if (const auto* type = std::get_if<std::string>(&o.value)) known->type = *type;
      known->where = o.source;
    }
    if (key == "params_file") known->has_other_files = true;
  }
}

std::string leaf(const std::string& node) {
  return node.substr(node.find_last_of('/') + 1);
}

// In Jazzy a section may declare its controller itself, by a `type`.
void read_sections(const ParameterFile& file, ControllersFile& out) {
  for (const std::string& node : file.nodes()) {
    if (is_controller_manager(node)) continue;
    const std::string name = leaf(node);
    const auto known = std::find_if(out.controllers.begin(), out.controllers.end(),
                                    [&](const DeclaredController& c) { return c.name == name; });
    ParameterOverrides all = file.overrides_for(rooted(node));
    if (known != out.controllers.end()) {
      if (known->parameters.all().empty()) known->parameters = std::move(all);
      continue;
    }
    const ParameterOverride* type = find(all, "type");
    const auto* text = type == nullptr ? nullptr : std::get_if<std::string>(&type->value);
    if (text != nullptr) {
      out.controllers.push_back({name, *text, type->source, std::move(all), false});
    } else if (!all.all().empty()) {
      out.other_sections.emplace_back(name, all.all().front().source);
    }
  }
}

// Parameters of one manager: those of the file's own names, else of wildcards.
std::vector<ParameterOverrides> managers_of(const ParameterFile& file) {
  std::vector<ParameterOverrides> out;
  for (const std::string& node : file.nodes()) {
    if (is_controller_manager(node)) out.push_back(file.overrides_for(rooted(node)));
  }
  if (out.empty()) out.push_back(file.overrides_for("/controller_manager"));
  return out;
}

// "joints", "left_wheel_names", "command_joints" and the like.
bool names_joints(std::string_view parameter) {
  const std::string_view last = parameter.substr(parameter.find_last_of('.') + 1);
  if (last == "extra_joints") return false;  // a broadcaster's, which the robot need not have
  constexpr std::array kEnds{"joint",        "joints",      "joint_name",  "joint_names",
                             "joints_names", "wheel_names", "wheels_names"};
  return std::any_of(kEnds.begin(), kEnds.end(), [&](const char* end) { return last.ends_with(end); });
}

}  // namespace

bool DeclaredController::known_kind() const {
  return type == "joint_trajectory_controller/JointTrajectoryController" || type == kDiffDrive ||
         type.starts_with("forward_command_controller/") || type.find("JointGroup") != std::string::npos;
}

std::vector<PlacedName> DeclaredController::texts(std::string_view parameter) const {
  std::vector<PlacedName> out;
  const ParameterOverride* o = find(parameters, parameter);
  if (o == nullptr) return out;
  if (const auto* one = std::get_if<std::string>(&o->value)) out.emplace_back(*one, o->source);
  if (const auto* many = std::get_if<std::vector<std::string>>(&o->value)) {
    for (std::size_t i = 0; i < many->size(); ++i) {
      out.emplace_back((*many)[i], i < o->elements.size() ? o->elements[i] : o->source);
    }
  }
  return out;
}

std::optional<std::pair<double, SourceLocation>> DeclaredController::number(
    std::string_view parameter) const {
  const ParameterOverride* o = find(parameters, parameter);
  if (o == nullptr) return std::nullopt;
  if (const auto* whole = std::get_if<std::int64_t>(&o->value))
    return std::pair{static_cast<double>(*whole), o->source};
  if (const auto* real = std::get_if<double>(&o->value)) return std::pair{*real, o->source};
  return std::nullopt;
}

std::vector<PlacedName> DeclaredController::interfaces(bool commands) const {
  if (type == "joint_trajectory_controller/JointTrajectoryController") {
    return texts(commands ? "command_interfaces" : "state_interfaces");
  }
  if (!commands) return {};
  if (type == "forward_command_controller/ForwardCommandController") return texts("interface_name");
  if (type == "forward_command_controller/MultiInterfaceForwardCommandController")
    return texts("interface_names");
  if (type == "position_controllers/JointGroupPositionController") return {{kPosition, where}};
  if (type == kDiffDrive || type == "velocity_controllers/JointGroupVelocityController")
    return {{kVelocity, where}};
  if (type == "effort_controllers/JointGroupEffortController") return {{kEffort, where}};
  return {};
}

std::vector<std::string> DeclaredController::driven_joints() const {
  std::vector<std::string> out;
  auto listed = texts("command_joints");
  if (listed.empty()) listed = texts("joints");
  if (listed.empty()) listed = texts("joint");
  if (type == kDiffDrive) {
    listed = texts("left_wheel_names");
    for (PlacedName& right : texts("right_wheel_names")) listed.push_back(std::move(right));
  }
  for (auto& placed : listed) out.push_back(std::move(placed.first));
  return out;
}

std::vector<std::string> DeclaredController::named_joints() const {
  std::vector<std::string> out;
  for (const ParameterOverride& o : parameters.all()) {
    if (!names_joints(o.name)) continue;
    for (PlacedName& placed : texts(o.name)) out.push_back(std::move(placed.first));
  }
  return out;
}

bool is_controller_manager(std::string_view node) {
  return node == "controller_manager" || node.ends_with("/controller_manager");
}

ControllersFile controllers_in(const ParameterFile& file) {
  ControllersFile out;
  out.path = file.name();
  out.of_ros1 = !file.text().empty() && !has_ros2_parameters(file.text());
  const std::vector<std::string> nodes = file.nodes();
  out.for_ros2 = std::any_of(nodes.begin(), nodes.end(), is_controller_manager);
  for (const ParameterOverrides& manager : managers_of(file)) {
    read_declarations(file, manager, out);
    const ParameterOverride* rate = find(manager, "update_rate");
    if (rate == nullptr) continue;
    out.rate_where = rate->source;
    if (const auto* whole = std::get_if<std::int64_t>(&rate->value))
      out.update_rate = static_cast<double>(*whole);
  }
  const auto typed = [](const DeclaredController& c) { return !c.type.empty(); };
  out.for_ros2 = out.for_ros2 || std::any_of(out.controllers.begin(), out.controllers.end(), typed);
  read_sections(file, out);
  return out;
}

}  // namespace doppel
