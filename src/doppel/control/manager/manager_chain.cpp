// Chains of controllers: one commands the reference interfaces of another and is updated before it
// in each tick.

#include <fmt/format.h>

#include <algorithm>

#include "doppel/control/hardware/nan.h"
#include "doppel/control/manager/detail/controller_manager.h"

namespace doppel {
void ControllerManager::Impl::offer_references(LoadedController& c) {
  for (const std::string& name : c.controller->reference_interfaces()) {
    const std::size_t slash = name.find_last_of('/');
    InterfaceDescription description{c.name + "/" + name.substr(0, slash), name.substr(slash + 1), kNaN};
    c.references.push_back(description.full_name());
    bool added = false;
    const std::size_t command = resources.offer_reference(c.name, std::move(description), added);
    if (added) limiter.add(resources, command);
    c.controller->reference_handles.push_back(resources.command_handle(command));
  }
  resources.set_references(c.name, false);
}

void ControllerManager::Impl::withdraw_references(LoadedController& c) {
  for (const std::string& name : c.references) resources.withdraw_reference(name);
  c.references.clear();
  c.controller->reference_handles.clear();
}

bool ControllerManager::Impl::commands_reference(const LoadedController& leader,
                                                 const LoadedController& follower) {
  return std::any_of(leader.commands.begin(), leader.commands.end(),
                     [&](const std::string& command) { return contains(follower.references, command); });
}

std::vector<LoadedController*> ControllerManager::Impl::ordered(const std::vector<LoadedController*>& all,
                                                                ChainOrder order) {
  std::vector<LoadedController*> out, seen;
  const std::function<void(LoadedController*)> visit = [&](LoadedController* c) {
    if (contains(seen, c)) return;
    seen.push_back(c);
    for (LoadedController* other : all) {
      const bool before = order == ChainOrder::leaders_first ? commands_reference(*other, *c)
                                                             : commands_reference(*c, *other);
      if (before) visit(other);
    }
    out.push_back(c);
  };
  for (LoadedController* c : all) visit(c);
  return out;
}

std::vector<LoadedController*> ControllerManager::Impl::with_leaders(
    std::vector<LoadedController*> followers) const {
  for (std::size_t i = 0; i < followers.size(); ++i) {
    for (LoadedController* c : active) {
      if (commands_reference(*c, *followers[i]) && !contains(followers, c)) followers.push_back(c);
    }
  }
  return ordered(followers, ChainOrder::leaders_first);
}

std::string ControllerManager::Impl::running_leader(const LoadedController& follower,
                                                    const Plan& plan) const {
  for (LoadedController* c : active) {
    if (contains(plan.stop, c) || !commands_reference(*c, follower)) continue;
    return fmt::format(
        "cannot deactivate '{}', because '{}' commands its reference interfaces; deactivate '{}' too",
        follower.name, c->name, c->name);
  }
  return "";
}

void ControllerManager::Impl::set_chained_modes() {
  for (LoadedController* c : active) {
    if (c->references.empty()) continue;
    const bool chained = std::any_of(active.begin(), active.end(), [&](const LoadedController* leader) {
      return commands_reference(*leader, *c);
    });
    if (chained == c->chained) continue;
    c->chained = chained;
    const Status set = attempt([&] {
      c->controller->set_chained_mode(chained);
      return Status{};
    });
    if (!set)
      log.error(options.name, fmt::format("'{}' failed to change its chained mode: {}", c->name, set.why()));
  }
}

std::vector<controller_manager_msgs::msg::ChainConnection> ControllerManager::Impl::chain_connections(
    const LoadedController& leader) const {
  std::vector<controller_manager_msgs::msg::ChainConnection> out;
  for (const auto& c : loaded) {
    controller_manager_msgs::msg::ChainConnection connection;
    connection.name = c->name;
    for (const std::string& command : leader.commands) {
      if (contains(c->references, command))
        connection.reference_interfaces.push_back(command.substr(c->name.size() + 1));
    }
    if (!connection.reference_interfaces.empty()) out.push_back(std::move(connection));
  }
  return out;
}

}  // namespace doppel
