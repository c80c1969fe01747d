#include <algorithm>

#include "doppel/audit/detail/controllers.h"
#include "doppel/audit/detail/ros_rules.h"
#include "doppel/audit/detail/side_files.h"
#include "doppel/control/hardware.h"
#include "doppel/core/names.h"

namespace doppel::audit_rules {
namespace {

namespace fs = std::filesystem;

bool is_manager(const std::string& node) {
  return node == "controller_manager" || node.ends_with("/controller_manager");
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
      out.controllers.push_back({name, "", o.source, file.overrides_for("/" + name), false, false});
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
    if (is_manager(node)) continue;
    const std::string name = leaf(node);
    const auto known = std::find_if(out.controllers.begin(), out.controllers.end(),
                                    [&](const DeclaredController& c) { return c.name == name; });
    ParameterOverrides all = file.overrides_for(node.starts_with('/') ? node : "/" + node);
    if (known != out.controllers.end()) {
      if (known->parameters.all().empty()) known->parameters = std::move(all);
      continue;
    }
    const ParameterOverride* type = find(all, "type");
    const auto* text = type == nullptr ? nullptr : std::get_if<std::string>(&type->value);
    if (text != nullptr) {
      out.controllers.push_back({name, *text, type->source, std::move(all), false, false});
    } else if (!all.all().empty()) {
      out.other_sections.emplace_back(name, all.all().front().source);
    }
  }
}

bool knows_interfaces(const std::string& type) {
  return type == "joint_trajectory_controller/JointTrajectoryController" ||
         type.starts_with("forward_command_controller/") || type.find("JointGroup") != std::string::npos;
}

std::optional<ControllersFile> read_file(const fs::path& path, bool chosen, Findings& out) {
  try {
    const ParameterFile file = ParameterFile::parse(read_side_file(path).text, path.string());
    ControllersFile result;
    result.path = path;
    result.chosen = chosen;
    for (const std::string& node : file.nodes()) {
      if (!is_manager(node)) continue;
      const ParameterOverrides manager = file.overrides_for(node.starts_with('/') ? node : "/" + node);
      read_declarations(file, manager, result);
      const ParameterOverride* rate = find(manager, "update_rate");
      if (rate == nullptr) continue;
      result.rate_where = rate->source;
      if (const auto* whole = std::get_if<std::int64_t>(&rate->value))
        result.update_rate = static_cast<double>(*whole);
    }
    read_sections(file, result);
    for (DeclaredController& c : result.controllers) c.known_kind = knows_interfaces(c.type);
    return result;
  } catch (const InputError& error) {
    for (const Diagnostic& d : error.diagnostics()) {
      out.add(d.rule == "audit.skipped" ? d.rule : "controllers.unreadable", path.filename().string(),
              d.where, d.message, d.mend);
    }
    return std::nullopt;
  }
}

// What is not of ROS 2 is not a controllers' file; what is not read at all is a note.
bool declares_controllers(const fs::path& path, Findings& out) {
  try {
    const auto nodes = ParameterFile::parse(read_side_file(path).text, path.string()).nodes();
    return std::any_of(nodes.begin(), nodes.end(), is_manager);
  } catch (const InputError& error) {
    if (error.diagnostics().front().rule == "audit.skipped") report_skipped(error, out);
    return false;
  }
}

// The file that <parameters> names and that is not there.
void report_missing(const GazeboPlugin& plugin, const std::string& file, Findings& out) {
  const fs::path path(file);
  Names there;
  for (const fs::path& entry : list_side_folder(path.parent_path()).entries)
    there.push_back(entry.filename().string());
  // Without its folder the package itself may be incomplete here; then nothing is certain.
  const Severity severity = there.empty() ? Severity::warning : Severity::error;
  out.add("controllers.file_missing", severity, fmt::format("<gazebo> plugin '{}'", plugin.filename),
          plugin.source,
          fmt::format("its <parameters> name '{}', which does not exist{}", file,
                      there.empty() ? "" : did_you_mean(path.filename().string(), there)),
          "correct the path, or write the file");
}

// A plain URDF that is always run through xacro keeps its $(find NAME) here.
std::string with_packages(std::string file, const PackageResolver& resolver) {
  constexpr std::string_view kOpen = "$(find ";
  const std::size_t at = file.find(kOpen);
  const std::size_t end = file.find(')', at);
  if (at == std::string::npos || end == std::string::npos) return file;
  const auto found = resolver.find_package(file.substr(at + kOpen.size(), end - at - kOpen.size()));
  return found.path.empty() ? file : file.replace(at, end - at + 1, found.path.string());
}

}  // namespace

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
  if (type == "velocity_controllers/JointGroupVelocityController") return {{kVelocity, where}};
  if (type == "effort_controllers/JointGroupEffortController") return {{kEffort, where}};
  return {};
}

std::vector<std::string> DeclaredController::driven_joints() const {
  std::vector<std::string> out;
  auto listed = texts("command_joints");
  if (listed.empty()) listed = texts("joints");
  if (listed.empty()) listed = texts("joint");
  for (auto& placed : listed) out.push_back(std::move(placed.first));
  return out;
}

std::vector<ControllersFile> read_controllers(const AuditInput& in, Findings& out) {
  std::vector<ControllersFile> files;
  const auto take = [&](const fs::path& path, bool chosen) {
    if (auto file = read_file(path, chosen, out)) files.push_back(std::move(*file));
  };
  if (in.options.controllers) {
    take(*in.options.controllers, true);
    return files;
  }
  std::vector<std::string> named;
  for (const GazeboExtension& gazebo : in.robot.gazebo) {
    for (const GazeboPlugin& plugin : gazebo.plugins) {
      if (find_gazebo_control_plugin(plugin.filename) == nullptr) continue;
      for (const std::string& written : plugin.parameter_files) {
        const std::string file = with_packages(written, in.resolver);
        if (contains(named, file)) continue;
        named.push_back(file);
        std::error_code none;
        if (fs::is_regular_file(file, none)) {
          take(file, true);
        } else {
          report_missing(plugin, file, out);
        }
      }
    }
  }
  if (!named.empty() || in.options.package_folder.empty()) return files;
  std::vector<fs::path> found;
  Diagnostics skipped;
  for (const fs::path& path :
       side_files_of(in.options.package_folder / "config", {".yaml", ".yml"}, skipped)) {
    if (declares_controllers(path, out)) found.push_back(path);
  }
  report_skipped(skipped, out);
  // Several belong to variants of the robot, and none of them is known to be this one's.
  if (found.size() == 1) take(found.front(), false);
  return files;
}

}  // namespace doppel::audit_rules
