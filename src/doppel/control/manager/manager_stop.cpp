// The emergency stop: latched until it is reset, the same for every client. The hardware stops its joints
// itself; commanding controllers are deactivated, so that no goal continues after the reset.

#include <fmt/format.h>

#include "doppel/control/manager/detail/controller_manager.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {

void ControllerManager::Impl::serve_stop() {
  stop_topic = node.advertise<std_msgs::msg::Bool>("~/emergency_stop_active", {.depth = 1, .latched = true});
  stop_topic.publish({stopped}, bus.now());
  node.subscribe<std_msgs::msg::Bool>("~/emergency_stop", [this](const auto& message) {
    if (message.data) stop("the topic ~/emergency_stop");
  });
  node.serve<std_srvs::srv::Trigger>("~/emergency_stop", [this](const auto&, auto respond) {
    const bool already = stopped;
    stop("the service ~/emergency_stop");
    respond({true, already ? "The emergency stop is already active."
                           : "Emergency stop active; ~/reset_emergency_stop resets it."});
  });
  node.serve<std_srvs::srv::Trigger>("~/reset_emergency_stop", [this](const auto&, auto respond) {
    const bool was = stopped;
    const Status status = reset_stop();
    respond({status.ok(), !status ? status.why()
                          : was   ? "The emergency stop is reset."
                                  : "The emergency stop is not active."});
  });
}

void ControllerManager::Impl::stop_component(ResourceTable::Component& c) {
  resources.call(c, "the emergency stop", [](HardwareComponent& hardware) { hardware.on_stop(); });
}

void ControllerManager::Impl::stop(const std::string& by) {
  if (stopped) return;
  stopped = true;
  resources.set_stopped(true);
  for (const auto& component : resources.components()) {
    if (component->state == HardwareState::active) stop_component(*component);
  }
  std::vector<LoadedController*> commanding;
  for (LoadedController* c : active) {
    if (!c->commands.empty()) commanding.push_back(c);
  }
  stopped_controllers.clear();
  for (const LoadedController* c : commanding) stopped_controllers.push_back(c->name);
  deactivate_all(commanding);
  settle(now);
  stop_topic.publish({stopped}, bus.now());
  log.warning(options.name,
              fmt::format("emergency stop by {}: no commands until it is reset (doppel stop --reset, or "
                          "{}/reset_emergency_stop); {} deactivated",
                          by, node.name(),
                          commanding.empty()       ? "no controllers were"
                          : commanding.size() == 1 ? fmt::format("'{}' is", commanding.front()->name)
                                                   : fmt::format("{} controllers are", commanding.size())));
}

Status ControllerManager::Impl::reset_stop() {
  if (!stopped) return {};
  stopped = false;
  resources.set_stopped(false);
  for (const auto& component : resources.components()) {
    if (component->state != HardwareState::active) continue;
    forget_commands(*component);
    resources.call(*component, "the reset of the emergency stop",
                   [](HardwareComponent& hardware) { hardware.on_stop_reset(); });
  }
  const bool failed = resources.has_fault();
  settle(now);
  stop_topic.publish({stopped}, bus.now());
  log.note(options.name, "the emergency stop is reset");
  std::vector<LoadedController*> again;
  for (const std::string& name : std::exchange(stopped_controllers, {})) {
    LoadedController* c = find(name);
    if (c != nullptr && c->state == ControllerState::inactive) again.push_back(c);
  }
  for (const LoadedController* c : ordered(again, ChainOrder::followers_first)) {
    const std::vector<std::string> one{c->name};
    if (const Status status = switch_controllers(one, {}, Strictness::strict); !status)
      log.error(options.name, fmt::format("cannot activate '{}' again: {}", c->name, status.why()));
  }
  return failed ? Status::refused("hardware failed during the reset; see the log and /diagnostics")
                : Status{};
}

}  // namespace doppel
