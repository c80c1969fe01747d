// Switching controllers: a request is planned as a whole, then carried out between two ticks.

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>

#include "doppel/base/core/names.h"
#include "doppel/control/manager/detail/controller_manager.h"

namespace doppel {
namespace {

std::vector<std::string> commands_of(const std::vector<LoadedController*>& controllers) {
  std::vector<std::string> out;
  for (const LoadedController* c : controllers) out.insert(out.end(), c->commands.begin(), c->commands.end());
  return out;
}

std::string joined(const std::vector<std::string>& sentences) {
  return fmt::format("{}", fmt::join(sentences, "; "));
}

}  // namespace

std::string ControllerManager::Impl::missing_interface(const LoadedController& c, const Plan& plan,
                                                       std::string* full_name) const {
  const auto missing = [&](const char* kind, const std::string& name,
                           const std::vector<std::string>& offered) {
    if (full_name != nullptr) *full_name = name;
    return fmt::format("'{}' requires the {} interface '{}', which no hardware exports{}", c.name, kind, name,
                       did_you_mean(name, offered));
  };
  const auto asleep = [&](const char* kind, const std::string& name,
                          const ResourceTable::Component& component) {
    if (full_name != nullptr) *full_name = name;
    return fmt::format("'{}' requires the {} interface '{}', but its hardware '{}' is {}", c.name, kind, name,
                       component.name, to_string(component.state));
  };
  for (const std::string& name : c.commands) {
    const auto command = resources.find_command(name);
    if (!command) return missing("command", name, resources.command_names());
    if (const std::string* owner = resources.controller_of(*command)) {
      LoadedController* follower = find(*owner);
      const bool runs = follower->state == ControllerState::active && !contains(plan.stop, follower);
      if (runs || contains(plan.start, follower)) continue;
      if (full_name != nullptr) *full_name = name;
      return fmt::format(
          "'{}' commands '{}', a reference interface of '{}', which is not active; activate '{}' "
          "before it or with it",
          c.name, name, *owner, *owner);
    }
    if (!resources.command_available(*command)) {
      return asleep("command", name, resources.component_of_command(*command));
    }
  }
  for (const std::string& name : c.states) {
    const auto state = resources.find_state(name);
    if (!state) return missing("state", name, resources.state_names());
    if (!resources.state_available(*state))
      return asleep("state", name, resources.component_of_state(*state));
  }
  return "";
}

ControllerManager::Impl::Plan ControllerManager::Impl::plan(std::span<const std::string> activate,
                                                            std::span<const std::string> deactivate,
                                                            Strictness strictness) const {
  Plan plan;
  const bool strict = strictness == Strictness::strict;
  std::vector<std::string> names;
  for (const auto& c : loaded) names.push_back(c->name);
  // ros2_control leaves unknown names out of a list; if all names of a list are unknown, nothing is switched.
  const auto unknown = [&](const std::string& name, std::span<const std::string> list) {
    const bool all = std::all_of(list.begin(), list.end(), [&](const auto& n) { return find(n) == nullptr; });
    (all ? plan.conflicts : plan.problems)
        .push_back(fmt::format("no controller '{}' is loaded{}", name, did_you_mean(name, names)));
  };
  for (const std::string& name : deactivate) {
    LoadedController* c = find(name);
    if (c == nullptr) {
      unknown(name, deactivate);
    } else if (c->state != ControllerState::active) {
      if (strict) plan.problems.push_back(fmt::format("'{}' is not active", name));
    } else if (!contains(plan.stop, c)) {
      plan.stop.push_back(c);
    }
  }
  for (const std::string& name : activate) {
    LoadedController* c = find(name);
    if (c == nullptr) {
      unknown(name, activate);
    } else if (c->state == ControllerState::unconfigured) {
      plan.problems.push_back(fmt::format("'{}' is not configured", name));
    } else if (c->state == ControllerState::active && !contains(plan.stop, c)) {
      if (strict) plan.problems.push_back(fmt::format("'{}' is already active", name));
    } else if (!contains(plan.start, c)) {
      plan.start.push_back(c);
    }
  }
  const auto commanding = std::find_if(plan.start.begin(), plan.start.end(),
                                       [](const LoadedController* c) { return !c->commands.empty(); });
  if (stopped && commanding != plan.start.end()) {
    plan.conflicts.push_back(
        fmt::format("'{}' commands joints, but the emergency stop is on; call {}/reset_emergency_stop first",
                    (*commanding)->name, node.name()));
  }
  plan_claims(plan);
  return plan;
}

// Controllers whose interfaces are not available after the plan's stops. As in ros2_control nothing is
// switched then: the arm would be passive after one controller has stopped and the other cannot start.
void ControllerManager::Impl::plan_claims(Plan& plan) const {
  std::map<std::string, std::string> holders;  // command interface -> controller
  for (const LoadedController* c : active) {
    if (contains(plan.stop, const_cast<LoadedController*>(c))) continue;
    for (const std::string& command : c->commands) holders[command] = c->name;
  }
  for (LoadedController* c : plan.start) {
    std::string why = missing_interface(*c, plan);
    for (const std::string& command : c->commands) {
      const auto holder = holders.find(command);
      if (!why.empty() || holder == holders.end()) continue;
      why = fmt::format(
          "'{}' claims the command interface '{}', which is claimed by '{}'; deactivate '{}' first", c->name,
          command, holder->second, holder->second);
    }
    for (const std::string& command : c->commands) holders.emplace(command, c->name);
    if (!why.empty()) plan.conflicts.push_back(std::move(why));
  }
  for (const LoadedController* c : plan.stop) {
    const bool starts_again = contains(plan.start, const_cast<LoadedController*>(c));
    if (std::string why = starts_again ? "" : running_leader(*c, plan); !why.empty())
      plan.conflicts.push_back(std::move(why));
  }
  plan.stop = ordered(plan.stop, ChainOrder::leaders_first);
  plan.start = ordered(plan.start, ChainOrder::followers_first);
}

Status ControllerManager::Impl::switch_controllers(std::span<const std::string> activate,
                                                   std::span<const std::string> deactivate,
                                                   Strictness strictness, bool* nothing_to_do) {
  const Plan wanted = plan(activate, deactivate, strictness);
  if (!wanted.conflicts.empty()) {
    std::vector<std::string> why = wanted.problems;
    why.insert(why.end(), wanted.conflicts.begin(), wanted.conflicts.end());
    return Status::refused(joined(why));
  }
  if (!wanted.problems.empty() && strictness == Strictness::strict)
    return Status::refused(joined(wanted.problems));
  for (const std::string& problem : wanted.problems) log.warning(options.name, "not switched: " + problem);
  const bool nothing_left = wanted.stop.empty() && wanted.start.empty();
  if (nothing_to_do != nullptr) *nothing_to_do = nothing_left;
  if (nothing_left) return {};
  if (Status ready = resources.prepare_switch(commands_of(wanted.start), commands_of(wanted.stop)); !ready)
    return ready;
  return carry_out(wanted, strictness);
}

Status ControllerManager::Impl::carry_out(const Plan& plan, Strictness strictness) {
  const std::vector<std::string> handed_over = stop_and_write(plan.stop);
  resources.perform_switch(commands_of(plan.start), handed_over);
  resources.read_all(now);
  std::vector<LoadedController*> started;
  std::vector<std::string> failures;
  for (LoadedController* c : plan.start) {
    if (const Status status = activate(*c, handed_over); !status) {
      failures.push_back(fmt::format("cannot activate '{}': {}", c->name, status.why()));
      if (strictness == Strictness::strict) break;
      resources.perform_switch({}, c->commands);
    } else {
      started.push_back(c);
    }
  }
  const bool give_up = !failures.empty() && strictness == Strictness::strict;
  if (give_up) {
    stop_and_write(started);
    resources.perform_switch({}, commands_of(plan.start));
    roll_back(plan.stop);
  }
  note_active();
  publish_activity();
  if (give_up || (!failures.empty() && started.empty() && plan.stop.empty()))
    return Status::refused(joined(failures));
  for (const std::string& failure : failures) log.error(options.name, failure);
  return {};
}

// After a failed strict switch the former controllers are activated again, so that no arm becomes passive.
void ControllerManager::Impl::roll_back(const std::vector<LoadedController*>& ran_before) {
  resources.perform_switch(commands_of(ran_before), {});
  resources.read_all(now);
  for (LoadedController* c : ordered(ran_before, ChainOrder::followers_first)) {
    if (const Status status = activate(*c, c->commands); !status) {
      resources.perform_switch({}, c->commands);
      log.error(options.name, fmt::format("cannot activate '{}' again: {}", c->name, status.why()));
    }
  }
}

// Published as by rcl_lifecycle: one event into the transition state and one out of it, with only the
// states filled in.
void ControllerManager::Impl::change_state(LoadedController& c, ControllerState to) {
  using State = lifecycle_msgs::msg::State;
  const auto whole = [](ControllerState state) {
    const std::uint8_t id = state == ControllerState::active     ? State::PRIMARY_STATE_ACTIVE
                            : state == ControllerState::inactive ? State::PRIMARY_STATE_INACTIVE
                                                                 : State::PRIMARY_STATE_UNCONFIGURED;
    return State{id, std::string(to_string(state))};
  };
  State passing{State::TRANSITION_STATE_CONFIGURING, "configuring"};
  if (to == ControllerState::active) passing = {State::TRANSITION_STATE_ACTIVATING, "activating"};
  if (to == ControllerState::unconfigured) passing = {State::TRANSITION_STATE_CLEANINGUP, "cleaningup"};
  if (c.state == ControllerState::active) passing = {State::TRANSITION_STATE_DEACTIVATING, "deactivating"};
  if (c.transitions.has_listeners()) {
    lifecycle_msgs::msg::TransitionEvent event;
    event.start_state = whole(c.state);
    event.goal_state = passing;
    c.transitions.publish(event, bus.now());
    event.start_state = passing;
    event.goal_state = whole(to);
    c.transitions.publish(event, bus.now());
  }
  c.state = to;
}

void ControllerManager::Impl::deactivate(LoadedController& c) {
  if (const Status status = attempt([&] { return c.controller->on_deactivate(); }); !status) {
    log.error(options.name, fmt::format("'{}' failed to deactivate: {}", c.name, status.why()));
  }
  release(c);
  resources.set_references(c.name, false);
  c.chained = false;
  change_state(c, ControllerState::inactive);
}

std::vector<std::string> ControllerManager::Impl::stop_and_write(
    const std::vector<LoadedController*>& controllers) {
  for (LoadedController* c : controllers) deactivate(*c);
  std::vector<std::string> released = commands_of(controllers);
  resources.write_last(now, released);
  return released;
}

void ControllerManager::Impl::release(LoadedController& c) {
  for (const std::string& name : c.commands) {
    const auto command = resources.find_command(name);
    if (!command) continue;
    limiter.release(*command, now, period);
    resources.claimed_by(*command).clear();
  }
  c.controller->command_handles.clear();
  c.controller->state_handles.clear();
}

// `handed_over`: commands that another controller has just released. They keep their last values, so that a
// servo that sags under load does not sag further at every switch; all others start from the description's
// initial value, which for joints is NaN.
Status ControllerManager::Impl::activate(LoadedController& c, std::span<const std::string> handed_over) {
  for (const std::string& name : c.commands) {
    const std::size_t command = *resources.find_command(name);
    if (std::find(handed_over.begin(), handed_over.end(), name) == handed_over.end()) {
      resources.asked(command) = resources.command_description(command).initial;
    } else {
      resources.asked(command) = resources.applied(command);
    }
    resources.claimed_by(command) = c.name;
    limiter.claim(command, c.name, c.ticks_per_update);
    c.controller->command_handles.push_back(resources.command_handle(command));
  }
  for (const std::string& name : c.states) {
    c.controller->state_handles.push_back(resources.state_handle(*resources.find_state(name)));
  }
  if (Status status = attempt([&] { return c.controller->on_activate(); }); !status) {
    release(c);
    return status;
  }
  change_state(c, ControllerState::active);
  resources.set_references(c.name, true);
  c.ticks_to_update = 1;
  c.next_housekeeping = now;
  return {};
}

void ControllerManager::Impl::note_active() {
  active.clear();
  for (const auto& c : loaded) {
    if (c->state == ControllerState::active) active.push_back(c.get());
  }
  active = ordered(active, ChainOrder::leaders_first);
  set_chained_modes();
}

void ControllerManager::Impl::restart(Time the_time) {
  // The last commands are written at the time that ends.
  const std::vector<LoadedController*> again = active;
  const std::vector<std::string> commands = stop_and_write(again);
  now = the_time;
  start_again(again, commands);
}

void ControllerManager::Impl::restart(const std::vector<LoadedController*>& again) {
  start_again(again, stop_and_write(again));
}

void ControllerManager::Impl::start_again(const std::vector<LoadedController*>& again,
                                          const std::vector<std::string>& commands) {
  resources.perform_switch({}, commands);
  resources.perform_switch(commands, {});
  for (const auto& component : resources.components()) {
    if (stopped && component->state == HardwareState::active) stop_component(*component);
  }
  resources.read_all(now);
  for (LoadedController* c : ordered(again, ChainOrder::followers_first)) {
    if (const Status status = activate(*c, {}); !status) {
      resources.perform_switch({}, c->commands);
      log.error(options.name, fmt::format("cannot activate '{}' again: {}", c->name, status.why()));
    }
  }
  note_active();
  publish_activity();
}

}  // namespace doppel
