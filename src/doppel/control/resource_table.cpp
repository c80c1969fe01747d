#include "doppel/control/resource_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "doppel/core/diagnostic.h"

namespace doppel {
namespace {

std::optional<std::size_t> lookup(const std::map<std::string, std::size_t, std::less<>>& index,
                                  std::string_view name) {
  const auto found = index.find(name);
  return found == index.end() ? std::nullopt : std::optional(found->second);
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
  }
  return "unconfigured";
}

ResourceTable::Component& ResourceTable::add(std::unique_ptr<SystemInterface> system) {
  auto component = std::make_unique<Component>();
  component->state_descriptions = system->state_interfaces();
  component->command_descriptions = system->command_interfaces();
  component->first_command = commands_.size();
  const auto enter = [&](const std::vector<InterfaceDescription>& offered, auto& index,
                         std::vector<Place>& places, std::vector<std::string>& names, const char* kind) {
    for (std::size_t i = 0; i < offered.size(); ++i) {
      names.push_back(offered[i].full_name());
      if (!index.emplace(names.back(), places.size()).second) {
        throw InputError("hardware.interface_twice", {},
                         fmt::format("the {} interface '{}' of hardware '{}' is offered already", kind,
                                     names.back(), system->name()),
                         "offer it once, in one <ros2_control> element");
      }
      places.push_back({component.get(), i});
    }
  };
  enter(component->state_descriptions, state_index_, states_, component->state_names, "state");
  enter(component->command_descriptions, command_index_, commands_, component->command_names, "command");
  for (const auto& description : component->state_descriptions)
    component->states.push_back(description.initial);
  const std::size_t count = component->command_descriptions.size();
  component->asked.assign(count, std::numeric_limits<double>::quiet_NaN());
  component->applied = component->asked;
  component->claimed_by.assign(count, "");
  component->system = std::move(system);
  components_.push_back(std::move(component));
  return *components_.back();
}

ResourceTable::Component* ResourceTable::find_component(std::string_view name) const {
  for (const auto& component : components_) {
    if (component->system->name() == name) return component.get();
  }
  return nullptr;
}

std::optional<std::size_t> ResourceTable::find_command(std::string_view full_name) const {
  return lookup(command_index_, full_name);
}
std::optional<std::size_t> ResourceTable::find_state(std::string_view full_name) const {
  return lookup(state_index_, full_name);
}

std::vector<std::string> ResourceTable::command_names() const {
  std::vector<std::string> names;
  for (const Place& place : commands_) names.push_back(place.component->command_names[place.index]);
  return names;
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
  return states_[state].component->state != HardwareState::unconfigured;
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

void ResourceTable::read(Time now, Duration period) {
  for (const auto& c : components_) {
    if (c->state != HardwareState::unconfigured) c->system->read(now, period, c->states);
  }
}

void ResourceTable::write(Time now, Duration period) {
  for (const auto& c : components_) {
    if (c->state == HardwareState::active) c->system->write(now, period, c->applied);
  }
}

Status ResourceTable::for_each_concerned(std::span<const std::string> start,
                                         std::span<const std::string> stop, const Action& action) {
  for (const auto& component : components_) {
    const auto own = [&](std::span<const std::string> names) {
      std::vector<std::string> out;
      for (const std::string& name : names) {
        const auto command = find_command(name);
        if (command && commands_[*command].component == component.get()) out.push_back(name);
      }
      return out;
    };
    const auto own_start = own(start), own_stop = own(stop);
    if (own_start.empty() && own_stop.empty()) continue;
    if (Status status = action(*component->system, own_start, own_stop); !status) return status;
  }
  return {};
}

Status ResourceTable::prepare_switch(std::span<const std::string> start, std::span<const std::string> stop) {
  return for_each_concerned(start, stop, [](SystemInterface& system, auto begin, auto end) {
    Status status = system.prepare_switch(begin, end);
    if (status) return status;
    return Status::refused(fmt::format("hardware '{}' refuses the switch: {}", system.name(), status.why()));
  });
}

void ResourceTable::perform_switch(std::span<const std::string> start, std::span<const std::string> stop) {
  static_cast<void>(for_each_concerned(start, stop, [](SystemInterface& system, auto begin, auto end) {
    system.perform_switch(begin, end);
    return Status{};
  }));
}

}  // namespace doppel
