// Starting a set of controllers as a whole: all errors are reported together, and then none is active.

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "doppel/control/manager/detail/controller_manager.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {

SourceLocation ControllerManager::Impl::place_of_interface(const LoadedController& c,
                                                           const std::string& full_name) const {
  const std::string_view prefix = std::string_view(full_name).substr(0, full_name.find_last_of('/'));
  for (const ParameterOverride& o : c.overrides.all()) {
    if (const auto* text = std::get_if<std::string>(&o.value); text != nullptr && *text == prefix)
      return o.source;
    const auto* list = std::get_if<std::vector<std::string>>(&o.value);
    if (list == nullptr) continue;
    for (std::size_t i = 0; i < list->size() && i < o.elements.size(); ++i) {
      if ((*list)[i] == prefix) return o.elements[i];
    }
  }
  return file == nullptr ? SourceLocation{} : make_location(file->name());
}

void ControllerManager::Impl::check_start(const std::vector<LoadedController*>& wanted) const {
  std::vector<Diagnostic> errors;
  std::map<std::string, const LoadedController*> holders;
  for (const LoadedController* c : active) {
    for (const std::string& command : c->commands) holders[command] = c;
  }
  Plan together;
  together.start = wanted;
  for (const LoadedController* c : wanted) {
    std::string name;
    if (const std::string why = missing_interface(*c, together, &name); !why.empty()) {
      errors.push_back({Severity::error, "control.no_interface", why, place_of_interface(*c, name),
                        "export it in the description's <ros2_control>, or claim another one"});
      continue;
    }
    for (const std::string& command : c->commands) {
      const auto [holder, is_free] = holders.emplace(command, c);
      if (is_free || holder->second == c) continue;
      const SourceLocation other = place_of_interface(*holder->second, command);
      errors.push_back(
          {Severity::error, "control.claimed_twice",
           fmt::format("'{0}' and '{2}' both claim the command interface '{1}'{3}", c->name, command,
                       holder->second->name, other.known() ? " at " + other.place() : ""),
           place_of_interface(*c, command),
           "only one controller can claim a command interface: remove the joint from one of them, or "
           "activate only one"});
    }
  }
  if (!errors.empty()) throw InputError(std::move(errors));
}

void ControllerManager::Impl::start(std::span<const std::string> names) {
  std::vector<LoadedController*> wanted;
  std::vector<std::string> loaded_here;
  std::vector<Diagnostic> errors;
  for (const std::string& name : names) {
    try {
      if (find(name) == nullptr) {
        load(name, "");
        loaded_here.push_back(name);
      }
      LoadedController& c = at(name);
      if (c.state == ControllerState::unconfigured) configure(c);
      if (c.state == ControllerState::inactive) wanted.push_back(&c);
    } catch (const InputError& problem) {
      errors.insert(errors.end(), problem.diagnostics().begin(), problem.diagnostics().end());
    }
  }
  // Broadcasters first, so that the first motion is already published.
  std::stable_partition(wanted.begin(), wanted.end(),
                        [](const LoadedController* c) { return c->commands.empty(); });
  try {
    if (!errors.empty()) throw InputError(std::move(errors));
    check_start(wanted);
    std::vector<std::string> order;
    for (const LoadedController* c : wanted) order.push_back(c->name);
    if (const Status status = switch_controllers(order, {}, Strictness::strict); !status) {
      throw InputError("control.start", file == nullptr ? SourceLocation{} : make_location(file->name()),
                       status.why());
    }
  } catch (const InputError&) {
    for (const std::string& name : loaded_here) static_cast<void>(unload(name));
    throw;
  }
}

void ControllerManager::Impl::leave_out(const std::string& name, const std::vector<Diagnostic>& why) {
  Diagnostic first = why.front();
  first.severity = Severity::warning;
  if (why.size() > 1)
    first.message += fmt::format("{} and {} more", first.message.ends_with('?') ? "" : ",", why.size() - 1);
  left_out.emplace_back(name, std::move(first));
  if (find(name) != nullptr) static_cast<void>(unload(name));
}

void ControllerManager::Impl::report_left_out(std::span<const std::string> names) {
  const bool others = std::any_of(active.begin(), active.end(), [&](const LoadedController* c) {
    return std::find(names.begin(), names.end(), c->name) != names.end();
  });
  for (auto& [name, why] : left_out) {
    why.message += fmt::format("{} '{}' is not started{}", why.message.ends_with('?') ? "" : ";", name,
                               others ? ", the others are" : "");
    log_diagnostic(log, options.name, why);
  }
  left_out.clear();
}

LoadedController* ControllerManager::Impl::try_to_load(const std::string& name) {
  try {
    if (find(name) == nullptr) load(name, "");
    LoadedController& c = at(name);
    if (c.state == ControllerState::unconfigured) configure(c);
    return &c;
  } catch (const InputError& problem) {
    leave_out(name, problem.diagnostics());
    return nullptr;
  }
}

std::vector<std::string> ControllerManager::Impl::compatible_of(std::vector<LoadedController*> wanted) {
  const auto rank = [](const LoadedController* c) {
    if (c->commands.empty()) return 0;
    return c->type == "joint_trajectory_controller/JointTrajectoryController" ? 1 : 2;
  };
  std::stable_sort(wanted.begin(), wanted.end(),
                   [&](const auto* a, const auto* b) { return rank(a) < rank(b); });
  std::vector<std::string> out;
  std::map<std::string, std::string> holders;
  for (const LoadedController* c : active) {
    for (const std::string& command : c->commands) holders[command] = c->name;
  }
  Plan fitting;  // followers come before their leaders
  for (LoadedController* c : ordered(wanted, ChainOrder::followers_first)) {
    std::string missing;
    if (const std::string why = missing_interface(*c, fitting, &missing); !why.empty()) {
      const std::string name = c->name;
      leave_out(name, {{Severity::warning, "control.no_interface", why, place_of_interface(*c, missing),
                        "export it in the description's <ros2_control>, or claim another one"}});
      continue;
    }
    const auto taken = std::find_if(c->commands.begin(), c->commands.end(),
                                    [&](const std::string& command) { return holders.contains(command); });
    if (taken != c->commands.end()) {
      log_diagnostic(log, options.name,
                     {Severity::note, "control.claimed_twice",
                      fmt::format("'{0}' stays inactive: the command interface '{2}' is claimed by '{1}'",
                                  c->name, holders[*taken], *taken),
                      place_of_interface(*c, *taken), "select one with --activate"});
      continue;
    }
    for (const std::string& command : c->commands) holders[command] = c->name;
    fitting.start.push_back(c);
    out.push_back(c->name);
  }
  return out;
}

void ControllerManager::Impl::start_compatible(std::span<const std::string> names) {
  std::vector<LoadedController*> wanted;
  for (const std::string& name : names) {
    LoadedController* const c = try_to_load(name);
    if (c != nullptr && c->state == ControllerState::inactive) wanted.push_back(c);
  }
  // One by one, so that one that refuses does not prevent the others.
  for (const std::string& name : compatible_of(std::move(wanted))) {
    const std::vector<std::string> one{name};
    if (const Status status = switch_controllers(one, {}, Strictness::strict); !status) {
      leave_out(name, {{Severity::warning, "control.start", status.why(),
                        file == nullptr ? SourceLocation{} : make_location(file->name()), ""}});
    }
  }
  report_left_out(names);
}

}  // namespace doppel
