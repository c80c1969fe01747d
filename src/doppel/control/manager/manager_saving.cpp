// Saved states of a manager: which controllers are active, and every value that changes from tick to tick.

#include <fmt/format.h>

#include "doppel/base/core/names.h"
#include "doppel/control/manager/detail/controller_manager.h"

namespace doppel {
namespace {

const SavedManager::One* find_saved(const SavedManager& saved, const std::string& name) {
  const auto found = std::ranges::find(saved.controllers, name, &SavedManager::One::name);
  return found == saved.controllers.end() ? nullptr : &*found;
}

bool was_active(const SavedManager& saved, const std::string& name) {
  const SavedManager::One* const one = find_saved(saved, name);
  return one != nullptr && one->state == ControllerState::active;
}

std::vector<std::string> claimed_by_all(const std::vector<LoadedController*>& controllers) {
  std::vector<std::string> out;
  for (const LoadedController* c : controllers) out.insert(out.end(), c->commands.begin(), c->commands.end());
  return out;
}

}  // namespace

std::string restored_reason(Time restored) {
  return fmt::format("the twin was restored to t = {:.3f} s, where this goal is not active",
                     to_seconds(restored));
}

Status ControllerManager::Impl::save(SavedManager& out) const {
  out.now = now;
  out.next_diagnostics = next_diagnostics;
  out.stopped = stopped;
  out.stopped_controllers = stopped_controllers;
  limiter.save(out.limits);
  out.controllers.resize(loaded.size());
  for (std::size_t i = 0; i < loaded.size(); ++i) {
    const LoadedController& c = *loaded[i];
    SavedManager::One& one = out.controllers[i];
    one.name = c.name;
    one.type = c.type;
    one.state = c.state;
    one.ticks_to_update = c.ticks_to_update;
    one.next_housekeeping = c.next_housekeeping;
    one.is_saved = c.state == ControllerState::unconfigured;
    if (!one.is_saved)
      one.is_saved =
          attempt([&] { return c.controller->save(one.run) ? Status{} : Status::refused("none"); }).ok();
  }
  return resources.save(out.resources);
}

std::vector<std::string> ControllerManager::Impl::differences(const SavedManager& saved) const {
  std::vector<std::string> out;
  for (const SavedManager::One& one : saved.controllers) {
    if (one.state != ControllerState::active) continue;
    const LoadedController* const c = find(one.name);
    if (c == nullptr) {
      out.push_back(fmt::format("the controller '{}', which was active, is not loaded", one.name));
    } else if (c->type != one.type) {
      out.push_back(fmt::format("the controller '{}' was a '{}' and is a '{}'", one.name, one.type, c->type));
    } else if (c->state == ControllerState::unconfigured) {
      out.push_back(fmt::format("the controller '{}', which was active, is not configured", one.name));
    }
  }
  for (const SavedResources::One& one : saved.resources.components) {
    const ResourceTable::Component* const c = resources.find_component(one.name);
    if (c == nullptr || c->states.size() != one.states.size() || c->asked.size() != one.asked.size()) {
      out.push_back(fmt::format("the hardware '{}' does not exist or has other interfaces", one.name));
    } else if (c->state == HardwareState::finalized && one.state != HardwareState::finalized) {
      out.push_back(fmt::format("the hardware '{}' is finalized", one.name));
    }
  }
  return out;
}

// Brings every component to the state of the life cycle that it had.
bool ControllerManager::Impl::restore_hardware(const SavedManager& saved) {
  bool changed = false;
  for (const SavedResources::One& one : saved.resources.components) {
    ResourceTable::Component* const c = resources.find_component(one.name);
    if (c == nullptr) continue;
    Status passed;
    while (passed && c->state != one.state) {
      passed = pass_towards(*c, one.state);
      changed = true;
    }
    if (!passed) log.error(options.name, passed.why());
    note_fault(*c, one.why);
  }
  return changed;
}

bool ControllerManager::Impl::restore_switches(const SavedManager& saved, Time the_time) {
  now = the_time;
  std::vector<LoadedController*> stop, start;
  for (const auto& c : loaded) {
    const bool ran = was_active(saved, c->name);
    if (c->state == ControllerState::active && !ran) stop.push_back(c.get());
    if (c->state == ControllerState::inactive && ran) start.push_back(c.get());
  }
  for (const LoadedController* c : stop)
    static_cast<void>(attempt([&] { return c->controller->abort_goals(restored_reason(now)), Status{}; }));
  deactivate_all(ordered(stop, ChainOrder::leaders_first));
  const bool switched = restore_hardware(saved) || !stop.empty() || !start.empty();
  if (stopped != saved.stopped) {
    stopped = saved.stopped;
    resources.set_stopped(stopped);
    stop_topic.publish({stopped}, bus.now());
  }
  stopped_controllers = saved.stopped_controllers;
  if (start.empty()) return switched;
  resources.perform_switch(claimed_by_all(start), {});
  resources.read_all(now);
  for (LoadedController* c : ordered(start, ChainOrder::followers_first)) {
    if (const Status status = activate(*c, {}); !status) {
      resources.perform_switch({}, c->commands);
      log.error(options.name, fmt::format("cannot activate '{}' again: {}", c->name, status.why()));
    }
  }
  note_active();
  publish_activity();
  return switched;
}

void ControllerManager::Impl::restore_values(const SavedManager& saved, Time the_time) {
  now = the_time;
  next_diagnostics = saved.next_diagnostics;
  controller_failed = false;
  resources.restore(saved.resources);
  limiter.restore(saved.limits);
  for (const SavedManager::One& one : saved.controllers) {
    LoadedController* const c = find(one.name);
    if (c == nullptr || c->type != one.type || c->state != one.state) continue;
    c->ticks_to_update = one.ticks_to_update;
    c->next_housekeeping = one.next_housekeeping;
    c->thrown = {};
    if (!one.is_saved || one.run == nullptr || one.state == ControllerState::unconfigured) continue;
    const Status restored = attempt([&] { return c->controller->restore(*one.run, now), Status{}; });
    if (!restored)
      log.error(options.name, fmt::format("'{}' failed to restore its state: {}", c->name, restored.why()));
  }
}

void ControllerManager::Impl::restart_unsaved(const SavedManager& saved, Time the_time) {
  std::vector<LoadedController*> again;
  for (LoadedController* c : active) {
    const SavedManager::One* const one = find_saved(saved, c->name);
    if (one != nullptr && !one->is_saved) again.push_back(c);
  }
  if (again.empty()) return;
  now = the_time;
  again = ordered(with_leaders(std::move(again)), ChainOrder::leaders_first);
  for (const LoadedController* c : again)
    static_cast<void>(attempt([&] { return c->controller->abort_goals(restored_reason(now)), Status{}; }));
  restart(again);
}

// -- the public class

Status ControllerManager::save(SavedSlot& slot) const {
  return impl_->save(value_in<SavedManager>(slot));
}

std::vector<std::string> ControllerManager::unsaved_controllers(const SavedPart& saved) {
  std::vector<std::string> out;
  if (const auto* const manager = value_of<SavedManager>(&saved)) {
    for (const SavedManager::One& one : manager->controllers)
      if (one.state == ControllerState::active && !one.is_saved) out.push_back(one.name);
  }
  return out;
}

std::vector<std::string> ControllerManager::differences(const SavedPart& saved) const {
  const auto* const manager = value_of<SavedManager>(&saved);
  return manager == nullptr ? std::vector<std::string>{"it is the state of no controller manager"}
                            : impl_->differences(*manager);
}

bool ControllerManager::restore_switches(const SavedPart& saved, Time now) {
  const auto* const manager = value_of<SavedManager>(&saved);
  return manager != nullptr && impl_->restore_switches(*manager, now);
}

void ControllerManager::restore_values(const SavedPart& saved, Time now) {
  if (const auto* const manager = value_of<SavedManager>(&saved)) impl_->restore_values(*manager, now);
}

void ControllerManager::restart_unsaved(const SavedPart& saved, Time now) {
  if (const auto* const manager = value_of<SavedManager>(&saved)) impl_->restart_unsaved(*manager, now);
}

}  // namespace doppel
