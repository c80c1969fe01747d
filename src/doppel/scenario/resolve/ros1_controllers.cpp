#include "doppel/scenario/resolve/ros1_controllers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "doppel/base/core/read_file.h"
#include "doppel/ros/bus/parameter_file_text.h"
#include "doppel/scenario/resolve/controllers_file.h"
#include "doppel/scenario/resolve/detail/ros1_mapping.h"

namespace doppel {
namespace {

constexpr std::string_view kTypeEnd = ".type";
constexpr std::string_view kLaunchArgument = "$(arg ";

// A text as a launch file with empty arguments would load it; their names are added.
std::string with_empty_arguments(std::string text, std::set<std::string>& arguments) {
  for (std::size_t at = text.find(kLaunchArgument); at != std::string::npos;
       at = text.find(kLaunchArgument)) {
    const std::size_t end = text.find(')', at);
    if (end == std::string::npos) break;
    const std::size_t name = at + kLaunchArgument.size();
    arguments.insert(text.substr(name, end - name));
    text.erase(at, end + 1 - at);
  }
  return text;
}

void empty_arguments(ParameterValue& value, std::set<std::string>& arguments) {
  if (auto* text = std::get_if<std::string>(&value)) *text = with_empty_arguments(*text, arguments);
  if (auto* texts = std::get_if<std::vector<std::string>>(&value)) {
    for (std::string& text : *texts) text = with_empty_arguments(text, arguments);
  }
}

struct Ros1Controller {
  std::string name, type;
  SourceLocation where;
  std::vector<ParameterOverride> values;
};

// A map with a `type` that is that of a plugin, as "diff_drive_controller/DiffDriveController" is.
std::vector<Ros1Controller> ros1_controllers_in(const std::vector<ParameterOverride>& all) {
  std::vector<Ros1Controller> out;
  for (const ParameterOverride& type : all) {
    const auto* text = std::get_if<std::string>(&type.value);
    if (text == nullptr || !type.name.ends_with(kTypeEnd)) continue;
    if (text->find("_controller/") == std::string::npos && text->find("_controllers/") == std::string::npos)
      continue;
    const std::string path = type.name.substr(0, type.name.size() - kTypeEnd.size());
    Ros1Controller controller{path.substr(path.find_last_of("./") + 1), *text, type.source, {}};
    for (const ParameterOverride& value : all) {
      if (&value == &type || !value.name.starts_with(path + ".")) continue;
      controller.values.push_back(value);
      controller.values.back().name = value.name.substr(path.size() + 1);
    }
    out.push_back(std::move(controller));
  }
  return out;
}

void report_mapping(const Ros1Controller& from, const Ros1Mapping& mapping,
                    const std::set<std::string>& arguments, Diagnostics& diagnostics) {
  std::string text =
      fmt::format("the controller '{}' of ROS 1 ({}) is mapped to {}", from.name, from.type, mapping.type);
  if (!mapping.derived.empty())
    text += fmt::format("; from the description: {}", fmt::join(mapping.derived, ", "));
  if (!arguments.empty())
    text += fmt::format("; arguments of its launch file are empty: {}", fmt::join(arguments, ", "));
  diagnostics.note("up.ros1_controllers", from.where, text, "write it as YAML of ros2_control");
  for (const std::string& parameter : mapping.unread()) {
    diagnostics.warning("up.ros1_parameter", mapping.place_of(parameter),
                        fmt::format("'{}' of the controller '{}' has no counterpart in ROS 2 and no effect",
                                    parameter, from.name));
  }
}

}  // namespace

bool has_ros2_parameters(const std::string& yaml) {
  return yaml.find("ros__parameters") != std::string::npos;
}

std::optional<ParameterFile> ros1_controllers(const std::string& yaml, const std::string& name,
                                              const RobotDescription& robot, Diagnostics& diagnostics) {
  if (has_ros2_parameters(yaml)) return std::nullopt;
  std::vector<ParameterOverride> all = read_plain_parameters(yaml, name).all();
  std::set<std::string> arguments;
  for (ParameterOverride& value : all) empty_arguments(value.value, arguments);
  std::vector<ParameterFile::Node> nodes{{"controller_manager", {}}};
  const std::vector<Ros1Controller> found = ros1_controllers_in(all);
  if (found.empty()) return std::nullopt;
  for (const Ros1Controller& controller : found) {
    Ros1Mapping mapping(controller.name, controller.values, robot);
    map_ros1_controller(controller.type, mapping);
    if (mapping.type.empty()) {
      diagnostics.warning(
          "up.ros1_controllers", controller.where,
          fmt::format("the controller type '{}' of ROS 1 has no counterpart in ros2_control; '{}' is not "
                      "started",
                      controller.type, controller.name),
          "declare a controller of ros2_control for its joints");
      continue;
    }
    report_mapping(controller, mapping, arguments, diagnostics);
    auto& manager = nodes.front().values;
    manager.push_back({controller.name + ".type", mapping.type, controller.where, {}, false});
    if (!mapping.remaps.empty())
      manager.push_back(
          {controller.name + ".node_options_args", mapping.remaps, controller.where, {}, false});
    for (ParameterOverride& value : mapping.mapped) {
      if (!value.source.known()) value.source = controller.where;
    }
    nodes.push_back({controller.name, std::move(mapping.mapped)});
  }
  return ParameterFile::of(std::move(nodes), yaml, name);
}

ParameterFile parse_controllers(const std::string& yaml, const std::string& name,
                                const RobotDescription& robot, Diagnostics& diagnostics) {
  if (auto mapped = ros1_controllers(yaml, name, robot, diagnostics)) return std::move(*mapped);
  ParameterFile file = ParameterFile::parse(yaml, name);
  if (std::ranges::any_of(file.nodes(), is_controller_manager)) return file;
  std::vector<ParameterOverride> declared;
  for (const DeclaredController& controller : controllers_in(file).controllers)
    declared.push_back(
        {controller.name + std::string(kTypeEnd), controller.type, controller.where, {}, false});
  if (!declared.empty()) file.add(ParameterFile::of({{"controller_manager", std::move(declared)}}, "", name));
  return file;
}

ParameterFile load_controllers(const std::filesystem::path& file, const RobotDescription& robot,
                               Diagnostics& diagnostics) {
  const FileContent content = read_content(file, kMaxParameterFileBytes);
  if (!content.was_read()) return ParameterFile::load(file);  // throws the reason
  return parse_controllers(content.bytes, file.string(), robot, diagnostics);
}

const ParameterOverride* Ros1Mapping::take(std::string_view parameter) {
  const auto found = std::ranges::find(values_, parameter, &ParameterOverride::name);
  if (found == values_.end()) return nullptr;
  found->used = true;
  return &*found;
}

std::optional<double> Ros1Mapping::number(std::string_view parameter) {
  const ParameterOverride* written = take(parameter);
  if (written == nullptr) return std::nullopt;
  if (const auto* whole = std::get_if<std::int64_t>(&written->value)) return static_cast<double>(*whole);
  if (const auto* real = std::get_if<double>(&written->value)) return *real;
  return std::nullopt;
}

bool Ros1Mapping::flag(std::string_view parameter, bool otherwise) {
  const ParameterOverride* written = take(parameter);
  const auto* value = written == nullptr ? nullptr : std::get_if<bool>(&written->value);
  return value == nullptr ? otherwise : *value;
}

std::vector<std::string> Ros1Mapping::names(std::string_view parameter) {
  const ParameterOverride* written = take(parameter);
  if (written == nullptr) return {};
  if (const auto* one = std::get_if<std::string>(&written->value)) return {*one};
  const auto* many = std::get_if<std::vector<std::string>>(&written->value);
  return many == nullptr ? std::vector<std::string>{} : *many;
}

void Ros1Mapping::set(const std::string& to, ParameterValue value, std::string_view from) {
  mapped.push_back({to, std::move(value), place_of(from), {}, false});
}

void Ros1Mapping::copy(std::string_view from, const std::string& to) {
  const ParameterOverride* written = take(from);
  if (written == nullptr) return;
  mapped.push_back(*written);
  mapped.back().name = to;
  mapped.back().used = false;
}

double Ros1Mapping::length(std::string_view parameter, std::optional<double> from_description,
                           const char* text) {
  if (const auto written = number(parameter)) return *written;
  if (!from_description) return 0.0;  // which the controller refuses
  derived.push_back(fmt::format("{} {:.4g} m", text, *from_description));
  return *from_description;
}

std::vector<std::string> Ros1Mapping::unread() const {
  std::vector<std::string> out;
  for (const ParameterOverride& value : values_) {
    if (!value.used) out.push_back(value.name);
  }
  return out;
}

SourceLocation Ros1Mapping::place_of(std::string_view parameter) const {
  const auto found = std::ranges::find(values_, parameter, &ParameterOverride::name);
  return found == values_.end() ? SourceLocation() : found->source;
}

}  // namespace doppel
