// What the controller manager's part of the YAML says, and that of each controller.

#include <fmt/format.h>

#include "doppel/control/controller_manager_detail.h"
#include "doppel/control/idle_parameters.h"
#include "doppel/core/names.h"

namespace doppel {
namespace {

Status positive(const ParameterValue& value) {
  const auto rate = std::get<std::int64_t>(value);
  return rate > 0 ? Status{}
                  : Status::refused(fmt::format("a rate must be more than 0 Hz, this is {}", rate));
}

}  // namespace

void ControllerManager::Impl::read_own_parameters(Diagnostics& diagnostics) {
  Parameters& parameters = node.parameters();
  const ParameterOverride* written = own.find("update_rate");
  const auto whole = declare<std::int64_t>(parameters, &own, "update_rate", std::llround(options.update_rate),
                                           {"Hz, of the loop: read, update, write", true, positive});
  const double rate = written != nullptr ? static_cast<double>(whole) : options.update_rate;
  steps_per_tick = whole_steps(rate, options.physics_step);
  period = options.physics_step * steps_per_tick;
  if (differs(rate, rate_of(period))) {
    diagnostics.warning("control.rate_rounded", written != nullptr ? written->source : SourceLocation{},
                        fmt::format("{:g} Hz does not divide the physics rate of {:g} Hz; the controller "
                                    "manager runs every {} step{}, at "
                                    "{:g} Hz",
                                    rate, rate_of(options.physics_step), steps_per_tick,
                                    steps_per_tick == 1 ? "" : "s", rate_of(period)),
                        fmt::format("choose a rate that divides {:g}, or another physics step",
                                    rate_of(options.physics_step)));
  }
  const bool enforce = declare<bool>(parameters, &own, "enforce_command_limits", options.enforce_limits,
                                     {"hold commands to the description's limits", true, {}});
  options.enforce_limits = options.enforce_limits && enforce;
  for (const char* state : {"inactive", "unconfigured"}) {
    declare<std::vector<std::string>>(parameters, &own,
                                      fmt::format("hardware_components_initial_state.{}", state), {},
                                      {fmt::format("hardware that starts {}", state), true, {}});
  }
  for (const auto& [name, type] : declared()) {
    declare<std::string>(parameters, &own, name + ".type", type, {"of this controller", true, {}});
    if (ParameterOverride* files = own.find(name + ".params_file")) {
      declare_parameter(parameters, &own, files->name, files->value, {"where its parameters are", true, {}});
    }
  }
  const auto strictness = [](const ParameterValue& value) {
    const auto& text = std::get<std::string>(value);
    const std::vector<std::string> known{"best_effort", "strict"};
    return text == known[0] || text == known[1]
               ? Status()
               : Status::refused(fmt::format("there is no '{}'{}", text, did_you_mean(text, known)));
  };
  declare<std::string>(parameters, &own, "defaults.switch_controller.strictness", "best_effort",
                       {"of a switch that does not say", false, strictness});
  declare_idle_parameters(parameters, own);
  report_unused(own, options.name, parameters.names(), diagnostics);
  report_sections_of_nobody(diagnostics);
}

// A section whose name is nearly that of a declared controller without one is a typo of it.
void ControllerManager::Impl::report_sections_of_nobody(Diagnostics& diagnostics) const {
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
  return out;
}

// The controller's part of the file, and of the files that its params_file names, relative to the first.
ParameterOverrides ControllerManager::Impl::overrides_of(const std::string& name,
                                                         const Node& its_node) const {
  if (file == nullptr) return ParameterOverrides{};
  const auto of = [&its_node](const ParameterFile& from) {
    return from.overrides_for(its_node.name(), its_node.given_name()).all();
  };
  std::vector<ParameterOverride> all = of(*file);
  for (const ParameterOverride& o : own.all()) {
    if (o.name != name + ".params_file") continue;
    std::vector<std::string> files;
    if (const auto* one = std::get_if<std::string>(&o.value)) files = {*one};
    if (const auto* many = std::get_if<std::vector<std::string>>(&o.value)) files = *many;
    for (const std::string& more : files) {
      const auto path = std::filesystem::path(file->name()).parent_path() / more;
      for (const ParameterOverride& value : of(ParameterFile::load(path))) {
        std::erase_if(all, [&](const ParameterOverride& before) { return before.name == value.name; });
        all.push_back(value);
      }
    }
  }
  return ParameterOverrides(std::move(all));
}

}  // namespace doppel
