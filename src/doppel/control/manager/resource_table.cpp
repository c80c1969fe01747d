#include "doppel/control/manager/detail/resource_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/thrown.h"

namespace doppel {
namespace {

std::optional<std::size_t> lookup(const std::map<std::string, std::size_t, std::less<>>& index,
                                  std::string_view name) {
  const auto found = index.find(name);
  return found == index.end() ? std::nullopt : std::optional(found->second);
}

bool is_of_joint(const InterfaceDescription& state) {
  return state.name == kPosition || state.name == kVelocity || state.name == kEffort;
}

}  // namespace

std::string_view to_string(HardwareState state) {
  switch (state) {
    case HardwareState::unconfigured:
      return "unconfigured";
    case HardwareState::inactive:
      return "inactive";
    case HardwareState::active:
      return "active";
    case HardwareState::finalized:
      return "finalized";
  }
  return "unconfigured";
}

std::string_view to_string(PassiveJoint passive) {
  switch (passive) {
    case PassiveJoint::free:
      return "free";
    case PassiveJoint::hold:
      return "held at their positions";
    case PassiveJoint::brake:
      return "braked";
  }
  return "free";
}

ResourceTable::Component& ResourceTable::add(std::unique_ptr<HardwareComponent> hardware,
                                             const HardwareDescription& description, int ticks_per_rw,
                                             Duration tick) {
  auto component = std::make_unique<Component>();
  component->name = description.name;
  component->type = description.type.empty() ? "system" : description.type;
  component->plugin = description.plugin;
  component->is_async = description.is_async;
  component->ticks_per_rw = ticks_per_rw;
  component->period = tick * ticks_per_rw;
  // The descriptions are copied before the interfaces are counted, and they do not change any more: handles
  // of controllers point into the vectors that are filled below.
  component->state_descriptions = hardware->state_interfaces();
  component->command_descriptions = hardware->command_interfaces();
  component->first_command = commands_.size();
  // All interfaces of a kind share one index by name; a name that another component exports is an error.
  const auto enter = [&](const std::vector<InterfaceDescription>& offered, auto& index,
                         std::vector<Place>& places, std::vector<std::string>& names, const char* kind) {
    for (std::size_t i = 0; i < offered.size(); ++i) {
      names.push_back(offered[i].full_name());
      if (!index.emplace(names.back(), places.size()).second) {
        throw InputError("hardware.interface_twice", {},
                         fmt::format("the {} interface '{}' of hardware '{}' is already exported", kind,
                                     names.back(), component->name),
                         "export it once, in one <ros2_control> element");
      }
      places.push_back({component.get(), i});
    }
  };
  enter(component->state_descriptions, state_index_, states_, component->state_names, "state");
  enter(component->command_descriptions, command_index_, commands_, component->command_names, "command");
  // States of joints must be finite while the component is active; sensors may report NaN.
  for (const auto& state : component->state_descriptions) {
    if (is_of_joint(state) && component->type != "sensor")
      component->joint_states.push_back(component->states.size());
    component->states.push_back(state.initial);
  }
  for (const auto& command : component->command_descriptions) component->asked.push_back(command.initial);
  component->applied = component->asked;
  component->claimed_by.assign(component->asked.size(), "");
  component->hardware = std::move(hardware);
  components_.push_back(std::move(component));
  return *components_.back();
}

ResourceTable::Component* ResourceTable::find_component(std::string_view name) const {
  for (const auto& component : components_) {
    if (component->name == name) return component.get();
  }
  return nullptr;
}

std::optional<std::size_t> ResourceTable::find_command(std::string_view full_name) const {
  return lookup(command_index_, full_name);
}
std::optional<std::size_t> ResourceTable::find_state(std::string_view full_name) const {
  return lookup(state_index_, full_name);
}

std::vector<std::size_t> ResourceTable::commands() const {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    if (command_index_.contains(command_name(i))) out.push_back(i);
  }
  return out;
}

std::vector<std::string> ResourceTable::command_names() const {
  std::vector<std::string> names;
  for (const std::size_t i : commands()) names.push_back(command_name(i));
  return names;
}

std::size_t ResourceTable::offer_reference(const std::string& controller, InterfaceDescription description,
                                           bool& added) {
  const std::string full_name = description.full_name();
  if (command_index_.contains(full_name)) {
    throw InputError("control.reference_twice", {},
                     fmt::format("the reference interface '{}' is already exported", full_name));
  }
  // A reference that was withdrawn keeps its place, so that the indices of other commands stay valid.
  const auto before = std::find_if(commands_.begin(), commands_.end(), [&](const Place& place) {
    return place.component->hardware == nullptr && place.component->command_names.front() == full_name;
  });
  added = before == commands_.end();
  const auto index = static_cast<std::size_t>(before - commands_.begin());
  command_index_.emplace(full_name, index);
  if (!added) return index;
  auto component = std::make_unique<Component>();
  component->name = controller;
  component->asked = component->applied = {description.initial};
  component->claimed_by.emplace_back();
  component->command_names = {full_name};
  component->command_descriptions = {std::move(description)};
  commands_.push_back({component.get(), 0});
  references_.push_back(std::move(component));
  return index;
}

void ResourceTable::withdraw_reference(const std::string& full_name) {
  command_index_.erase(full_name);
}

void ResourceTable::set_references(const std::string& controller, bool available) {
  for (const auto& reference : references_) {
    if (reference->name == controller)
      reference->state = available ? HardwareState::active : HardwareState::inactive;
  }
}

const std::string* ResourceTable::controller_of(std::size_t command) const {
  const Component& component = *commands_[command].component;
  return component.hardware == nullptr ? &component.name : nullptr;
}

std::vector<std::string> ResourceTable::state_names() const {
  std::vector<std::string> names;
  for (const Place& place : states_) names.push_back(place.component->state_names[place.index]);
  return names;
}

CommandHandle ResourceTable::command_handle(std::size_t command) const {
  const Place& p = commands_[command];
  return {&p.component->command_names[p.index], p.component->command_descriptions[p.index].prefix.size(),
          &p.component->asked[p.index]};
}

StateHandle ResourceTable::state_handle(std::size_t state) const {
  const Place& p = states_[state];
  return {&p.component->state_names[p.index], p.component->state_descriptions[p.index].prefix.size(),
          &p.component->states[p.index]};
}

const InterfaceDescription& ResourceTable::command_description(std::size_t command) const {
  return commands_[command].component->command_descriptions[commands_[command].index];
}
const std::string& ResourceTable::command_name(std::size_t command) const {
  return commands_[command].component->command_names[commands_[command].index];
}
bool ResourceTable::command_available(std::size_t command) const {
  return commands_[command].component->state == HardwareState::active;
}
bool ResourceTable::state_available(std::size_t state) const {
  return states_[state].component->is_read();
}
const ResourceTable::Component& ResourceTable::component_of_command(std::size_t command) const {
  return *commands_[command].component;
}
const ResourceTable::Component& ResourceTable::component_of_state(std::size_t state) const {
  return *states_[state].component;
}
double& ResourceTable::asked(std::size_t command) {
  return commands_[command].component->asked[commands_[command].index];
}
double& ResourceTable::applied(std::size_t command) {
  return commands_[command].component->applied[commands_[command].index];
}
const double& ResourceTable::state(std::size_t state) const {
  return states_[state].component->states[states_[state].index];
}
std::string& ResourceTable::claimed_by(std::size_t command) {
  return commands_[command].component->claimed_by[commands_[command].index];
}

void note_thrown(LoopExceptionText& text) noexcept {
  try {
    throw;
  } catch (const std::exception& problem) {
    std::strncpy(text.data(), problem.what(), text.size() - 1);
  } catch (...) {
    std::strncpy(text.data(), "it threw something other than a std::exception", text.size() - 1);
  }
  if (text[0] == '\0') std::strncpy(text.data(), "no reason given", text.size() - 1);
}

// Runs `call`, which returns a HardwareReturn; any other value than ok, and any exception, becomes
// the component's fault.
template <class Call>
void ResourceTable::guarded(Component& c, const char* during, const Call& call) noexcept {
  HardwareReturn answer = HardwareReturn::error;
  LoopExceptionText thrown{};
  try {
    answer = call();
  } catch (...) {
    note_thrown(thrown);
  }
  // The fault is only noted here, because this runs in the loop: the manager takes it between two ticks,
  // reports it and changes the component's state, all of which allocates.
  if (answer == HardwareReturn::ok) return;
  c.fault = {during, answer, thrown};
  has_fault_ = true;
}

void ResourceTable::read(Component& c, Time now) {
  c.not_finite.reset();
  if (!c.is_read() || c.fault.any()) return;
  guarded(c, "read", [&] { return c.hardware->read(now, c.period, c.states); });
  // A driver may not know a state before it is active.
  if (c.state != HardwareState::active) return;
  const auto bad =
      std::ranges::find_if(c.joint_states, [&](std::size_t i) { return !std::isfinite(c.states[i]); });
  // A component that has reported the same joint is not reported in each tick again.
  c.not_finite = bad == c.joint_states.end() ? std::nullopt : std::optional(*bad);
  has_not_finite_ = has_not_finite_ || (c.not_finite && !c.not_finite_reported);
}

void ResourceTable::write(Component& c, Time now) {
  // After a fault no command follows until the component was recovered, also within the same tick.
  if (stopped_ || c.state != HardwareState::active || c.fault.any()) return;
  guarded(c, "write", [&] { return c.hardware->write(now, c.period, c.applied); });
}

// A component with a lower rate is read in the tick in which its countdown ends, and written in the same
// one.
void ResourceTable::read(Time now) {
  for (const auto& c : components_) {
    if (--c->ticks_to_rw <= 0) read(*c, now);
  }
}

void ResourceTable::write(Time now) {
  for (const auto& c : components_) {
    if (c->ticks_to_rw > 0) continue;
    c->ticks_to_rw = c->ticks_per_rw;
    write(*c, now);
  }
}

void ResourceTable::read_all(Time now) {
  for (const auto& c : components_) read(*c, now);
}

void ResourceTable::attend() {
  for (const auto& c : components_)
    call(*c, "attend", [](HardwareComponent& hardware) { hardware.attend(); });
}

void ResourceTable::call(Component& c, const char* during,
                         const std::function<void(HardwareComponent&)>& call) {
  guarded(c, during, [&] {
    call(*c.hardware);
    return HardwareReturn::ok;
  });
}

void ResourceTable::forget_commands(Component& c) {
  // A command of before a stop must not act when the component is activated again.
  for (std::size_t i = 0; i < c.asked.size(); ++i) c.asked[i] = c.command_descriptions[i].initial;
  c.applied = c.asked;
}

std::vector<ResourceTable::Component*> ResourceTable::take_not_finite() {
  std::vector<Component*> out;
  for (const auto& c : components_) {
    if (c->not_finite && !std::exchange(c->not_finite_reported, true)) out.push_back(c.get());
  }
  has_not_finite_ = false;
  return out;
}

std::vector<std::pair<ResourceTable::Component*, HardwareFault>> ResourceTable::take_faults() {
  std::vector<std::pair<Component*, HardwareFault>> out;
  for (const auto& c : components_) {
    if (c->fault.any()) out.emplace_back(c.get(), std::exchange(c->fault, {}));
  }
  has_fault_ = false;
  return out;
}

Status ResourceTable::save(SavedResources& out) const {
  const auto copy = [](const Component& c, SavedResources::One& one) {
    one.name = c.name;
    one.state = c.state;
    one.states = c.states;
    one.asked = c.asked;
    one.applied = c.applied;
    one.ticks_to_rw = c.ticks_to_rw;
    one.why = c.why;
    one.not_finite_reported = c.not_finite_reported;
  };
  std::string unsaved;
  out.components.resize(components_.size());
  for (std::size_t i = 0; i < components_.size(); ++i) {
    copy(*components_[i], out.components[i]);
    if (!components_[i]->hardware->save(out.components[i].run))
      unsaved += fmt::format("{}'{}' ({})", unsaved.empty() ? "" : ", ", components_[i]->name,
                             components_[i]->plugin);
  }
  out.references.resize(references_.size());
  for (std::size_t i = 0; i < references_.size(); ++i) {
    copy(*references_[i], out.references[i]);
    out.references[i].name = references_[i]->command_names.front();  // their components have one name
  }
  if (unsaved.empty()) return {};
  return Status::refused("the state of this hardware cannot be saved: " + unsaved);
}

void ResourceTable::restore(const SavedResources& saved) {
  const auto copy = [](const SavedResources::One& one, Component& c) {
    // Handles of controllers point into these vectors, whose sizes belong to the interfaces.
    std::ranges::copy(one.states, c.states.begin());
    std::ranges::copy(one.asked, c.asked.begin());
    std::ranges::copy(one.applied, c.applied.begin());
    c.ticks_to_rw = one.ticks_to_rw;
    c.not_finite_reported = one.not_finite_reported;
  };
  for (const auto& one : saved.components) {
    Component* const c = find_component(one.name);
    if (c == nullptr || c->states.size() != one.states.size() || c->asked.size() != one.asked.size())
      continue;
    copy(one, *c);
    c->fault = {};
    c->not_finite.reset();
    if (one.run) c->hardware->restore(*one.run);
  }
  for (const auto& one : saved.references) {
    const auto same = std::ranges::find_if(
        references_, [&one](const auto& c) { return c->command_names.front() == one.name; });
    if (same != references_.end()) copy(one, **same);
  }
  has_fault_ = has_not_finite_ = false;
}

Status ResourceTable::for_each_concerned(std::span<const std::string> start,
                                         std::span<const std::string> stop, const Action& action) {
  // Each component is called once, with the interfaces of its own among those that start and stop.
  for (const auto& component : components_) {
    const auto own = [&](std::span<const std::string> names) {
      std::vector<std::string> out;
      for (const std::string& name : names) {
        const auto command = find_command(name);
        if (command && commands_[*command].component == component.get()) out.push_back(name);
      }
      return out;
    };
    if (!component->is_read()) continue;
    const auto own_start = own(start), own_stop = own(stop);
    if (own_start.empty() && own_stop.empty()) continue;
    if (Status status = action(*component, own_start, own_stop); !status) return status;
  }
  return {};
}

Status ResourceTable::prepare_switch(std::span<const std::string> start, std::span<const std::string> stop) {
  // The first component that refuses ends the switch; nothing has changed then.
  return for_each_concerned(start, stop, [](Component& c, auto begin, auto end) {
    Status status;
    try {
      status = c.hardware->prepare_switch(begin, end);
    } catch (...) {
      status = Status::refused(thrown_text());
    }
    if (status) return status;
    return Status::refused(fmt::format("hardware '{}' rejects the switch: {}", c.name, status.why()));
  });
}

void ResourceTable::perform_switch(std::span<const std::string> start, std::span<const std::string> stop) {
  static_cast<void>(for_each_concerned(start, stop, [this](Component& c, auto begin, auto end) {
    call(c, "the switch of controllers",
         [&](HardwareComponent& hardware) { hardware.perform_switch(begin, end); });
    return Status{};
  }));
}

void ResourceTable::write_last(Time now, std::span<const std::string> commands) {
  static_cast<void>(for_each_concerned({}, commands, [&](Component& c, auto, auto) {
    write(c, now);
    return Status{};
  }));
}

}  // namespace doppel
