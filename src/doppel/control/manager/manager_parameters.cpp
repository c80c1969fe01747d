// The controller manager's section of the YAML, and that of each controller.

#include <fmt/format.h>

#include "doppel/base/core/names.h"
#include "doppel/control/manager/detail/controller_manager.h"
#include "doppel/control/manager/detail/idle_parameters.h"
#include "doppel/control/manager/distro_differences.h"
#include "doppel/ros/bus/node_arguments.h"

namespace doppel {
namespace {

constexpr const char* kParamsFile = ".params_file";
constexpr const char* kArguments = ".node_options_args";

Status positive(const ParameterValue& value) {
  const auto rate = std::get<std::int64_t>(value);
  return rate > 0 ? Status{} : Status::refused(fmt::format("a rate must be above 0 Hz: {}", rate));
}

}  // namespace

void ControllerManager::Impl::read_own_parameters(Diagnostics& diagnostics) {
  Parameters& parameters = node.parameters();
  const ParameterOverride* written = own.find("update_rate");
  const auto whole = declare<std::int64_t>(parameters, &own, "update_rate", std::llround(options.update_rate),
                                           {"Hz, of the loop read, update, write", true, positive});
  const double rate = written != nullptr ? static_cast<double>(whole) : options.update_rate;
  const SourceLocation where = written != nullptr ? written->source : SourceLocation{};
  period = options.choose_period ? options.choose_period(rate, where, diagnostics) : from_seconds(1.0 / rate);
  const bool enforce = declare<bool>(parameters, &own, "enforce_command_limits", options.enforce_limits,
                                     {"enforce the description's joint limits on commands", true, {}});
  options.enforce_limits = options.enforce_limits && enforce;
  for (const char* state : {"inactive", "unconfigured"}) {
    declare<std::vector<std::string>>(parameters, &own,
                                      fmt::format("hardware_components_initial_state.{}", state), {},
                                      {fmt::format("hardware components that start {}", state), true, {}});
  }
  for (const auto& [name, type] : declared()) {
    // A spawner sets them again, later than the file.
    declare<std::string>(parameters, &own, name + ".type", type, {"of this controller", false, {}});
    const auto declare_written = [&, &controller = name](const char* key, const char* description) {
      if (const ParameterOverride* written_there = own.find(controller + key))
        declare_parameter(parameters, &own, written_there->name, written_there->value,
                          {.description = description, .dynamic_typing = true});
    };
    declare_written(kParamsFile, "its parameter files");
    declare_written(kArguments, "--ros-args of its node");
    declare_written(kFallback, "controllers that replace it when its hardware fails");
  }
  const auto strictness = [](const ParameterValue& value) {
    const auto& text = std::get<std::string>(value);
    const std::vector<std::string> known{"best_effort", "strict"};
    return text == known[0] || text == known[1]
               ? Status()
               : Status::refused(fmt::format("unknown '{}'{}", text, did_you_mean(text, known)));
  };
  constexpr const char* kStrictness = "defaults.switch_controller.strictness";
  const DistroDefault* const changed = changed_default("controller_manager", kStrictness);
  declare<std::string>(parameters, &own, kStrictness,
                       changed == nullptr ? "best_effort" : std::string(std::get<std::string_view>(*changed)),
                       {"default of a switch request", false, strictness});
  declare_idle_parameters(parameters, own);
  report_unused(own, options.name, parameters.names(), diagnostics);
  report_unused_sections(diagnostics);
}

// A section with nearly the name of a declared controller that has no section is a typo of that name.
void ControllerManager::Impl::report_unused_sections(Diagnostics& diagnostics) const {
  if (file == nullptr) return;
  std::vector<std::string> without, with;
  for (const std::string& section : file->nodes())
    with.push_back(section.substr(section.find_last_of('/') + 1));
  for (const auto& [name, type] : declared()) {
    if (std::find(with.begin(), with.end(), name) == with.end()) without.push_back(name);
  }
  const auto all = declared();
  for (const std::string& section : with) {
    const bool known = std::any_of(all.begin(), all.end(), [&](const auto& d) { return d.first == section; });
    if (known || section == options.name) continue;
    if (const auto near = nearest_name(section, without)) {
      diagnostics.warning(
          "control.section_of_nobody", make_location(file->name()),
          fmt::format("the section '{}' belongs to no controller; did you mean '{}'?", section, *near));
    }
  }
}

std::vector<std::pair<std::string, std::string>> ControllerManager::Impl::declared() const {
  constexpr std::string_view kSuffix = ".type";
  std::vector<std::pair<std::string, std::string>> out;
  for (const ParameterOverride& o : own.all()) {
    const auto* type = std::get_if<std::string>(&o.value);
    if (type == nullptr || !std::string_view(o.name).ends_with(kSuffix)) continue;
    out.emplace_back(o.name.substr(0, o.name.size() - kSuffix.size()), *type);
  }
  if (file == nullptr) return out;
  // In Jazzy a controller's own section may have its type, for spawners with --param-file.
  for (const std::string& section : file->nodes()) {
    const std::string name = section.substr(section.find_last_of('/') + 1);
    if (std::ranges::any_of(out, [&](const auto& known) { return known.first == name; })) continue;
    ParameterOverrides all = file->overrides_for(expand_name(name, node.given_name()));
    const ParameterOverride* written = all.find("type");
    const auto* type = written == nullptr ? nullptr : std::get_if<std::string>(&written->value);
    if (type != nullptr && type->find('/') != std::string::npos) out.emplace_back(name, *type);
  }
  return out;
}

// A parameter of the manager that is one string or a list of strings; empty if it is absent.
std::vector<std::string> ControllerManager::Impl::texts_of(const std::string& parameter) {
  const auto* value = node.parameters().find(parameter);
  if (value == nullptr) return {};
  if (const auto* one = std::get_if<std::string>(&value->value)) return {*one};
  if (const auto* many = std::get_if<std::vector<std::string>>(&value->value)) return *many;
  throw InputError("control.not_texts", {},
                   fmt::format("the parameter '{}' of {} is {}, but must be a string or a string_array",
                               value->name, node.name(), parameter_type_name(value->value)));
}

// A file with a controller's parameters: relative to the manager's file if it exists there, else relative to
// the working directory, as for a spawner.
std::filesystem::path ControllerManager::Impl::params_file(const std::string& name,
                                                           const std::string& text) const {
  const auto is_file = [](const std::filesystem::path& path) {
    std::error_code ignored;  // a pipe or a device would stop the loop
    return std::filesystem::is_regular_file(path, ignored);
  };
  const auto beside = file == nullptr ? std::filesystem::path(text)
                                      : std::filesystem::path(file->name()).parent_path() / text;
  const auto found = is_file(beside) ? beside : std::filesystem::absolute(text);
  if (is_file(found)) return found;
  throw InputError(
      "control.params_file", {},
      fmt::format("the params_file '{}' of '{}' is not a readable file: {}", text, name,
                  beside.is_absolute() || beside == text
                      ? found.string()
                      : fmt::format("neither {} nor {}", beside.string(), found.string())),
      "give an absolute path: the twin reads the file, relative to the folder it was started in");
}

// The present value of NAME.node_options_args, which a spawner sets from --controller-ros-args.
NodeArguments ControllerManager::Impl::arguments_of(const std::string& name, const std::string& full_name) {
  std::vector<std::string> words = texts_of(name + kArguments);
  if (words.empty()) return {};
  NodeArguments arguments = read_node_arguments(std::move(words), full_name, bus.names());
  for (const auto& given : arguments.parameters) {
    const auto* one = std::get_if<GivenParameter>(&given);
    if (one == nullptr || one->name != "use_sim_time" || one->value == ParameterValue(bus.sim_time()))
      continue;
    throw InputError("node.arguments", {},
                     fmt::format("-p {} has no effect: the twin has one clock", one->text),
                     "start the twin with --stamp sim or --stamp wall");
  }
  return arguments;
}

// The controller's section of the file, of its params_files, and of its arguments; later ones have priority.
ParameterOverrides ControllerManager::Impl::overrides_of(const LoadedController& c,
                                                         const NodeArguments& arguments) {
  std::vector<ParameterOverride> all;
  const auto add = [&](const ParameterFile& from) {
    const ParameterOverrides here = from.overrides_for(c.node->name(), c.node->given_name());
    for (const ParameterOverride& value : here.all()) {
      std::erase_if(all, [&](const ParameterOverride& before) { return before.name == value.name; });
      all.push_back(value);
    }
  };
  if (file != nullptr) add(*file);
  for (const std::string& text : texts_of(c.name + kParamsFile))
    add(ParameterFile::load(params_file(c.name, text)));
  for (const auto& given : arguments.parameters) {
    if (const auto* from = std::get_if<GivenParameterFile>(&given)) {
      add(ParameterFile::load(params_file(c.name, from->path)));
    } else {
      const auto& one = std::get<GivenParameter>(given);
      ParameterFile said;
      said.add(one.node, one.name, one.value, "-p " + one.text);
      add(said);
    }
  }
  return ParameterOverrides(std::move(all));
}

}  // namespace doppel
