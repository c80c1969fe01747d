// The life cycle of hardware components, and the reaction to the failure of one.

#include <fmt/format.h>

#include <cctype>

#include "doppel/base/core/names.h"
#include "doppel/control/hardware/async_hardware.h"
#include "doppel/control/manager/detail/controller_manager.h"
#include "doppel/control/manager/joint_list.h"
#include "doppel/ros/bus/standard_node.h"

namespace doppel {
namespace {

constexpr const char* kFault = "fault";

std::string quoted_names(const std::vector<LoadedController*>& controllers) {
  std::string out;
  for (const LoadedController* c : controllers)
    out += fmt::format("{}'{}'", out.empty() ? "" : ", ", c->name);
  return out;
}

bool uses(const LoadedController& c, const ResourceTable::Component& component) {
  const auto any = [](const std::vector<std::string>& wanted, const std::vector<std::string>& offered) {
    return std::any_of(wanted.begin(), wanted.end(), [&](const std::string& name) {
      return std::find(offered.begin(), offered.end(), name) != offered.end();
    });
  };
  return any(c.commands, component.command_names) || any(c.states, component.state_names);
}

}  // namespace

ResourceTable::Component& ControllerManager::Impl::initialise_hardware(
    std::unique_ptr<HardwareComponent> hardware, const HardwareDescription& description,
    Diagnostics& diagnostics) {
  const double asked = description.rw_rate.value_or(rate_of(period));
  if (description.is_async) hardware = std::make_unique<AsyncHardware>(std::move(hardware), asked);
  const int ticks = description.is_async ? 1 : steps_per_period(asked, period);
  const double rate = description.is_async ? asked : rate_of(period * ticks);
  if (differs(asked, rate)) {
    diagnostics.warning(
        "hardware.rate_rounded", description.source,
        fmt::format("rw_rate {:g} Hz does not divide the controller manager's {:g} Hz; '{}' is read and "
                    "written every {} tick{}, at {:g} Hz",
                    asked, rate_of(period), description.name, ticks, ticks == 1 ? "" : "s", rate),
        fmt::format("choose a rate that divides {:g}", rate_of(period)));
  }
  std::string why;
  try {
    const Status status = hardware->on_init({description, *model, log, rate, diagnostics});
    if (!status) why = status.why();
  } catch (const InputError&) {
    throw;
  } catch (...) {
    why = thrown_text();
  }
  if (!why.empty()) {
    throw InputError(
        "hardware.on_init", description.plugin_source,
        fmt::format("cannot initialise hardware '{}' ({}): {}", description.name, description.plugin, why),
        "correct its <param>s, or use another plugin");
  }
  ResourceTable::Component& component = resources.add(std::move(hardware), description, ticks, period);
  component.rw_rate = rate;
  return component;
}

Status ControllerManager::Impl::add_hardware(std::unique_ptr<HardwareComponent> hardware,
                                             const HardwareDescription& description,
                                             Diagnostics& diagnostics) {
  ResourceTable::Component& component = initialise_hardware(std::move(hardware), description, diagnostics);
  make_hardware_node(component.name);
  for (std::size_t i = 0; i < component.command_names.size(); ++i) {
    limiter.add(resources, component.first_command + i);
    guarded.add(resources, *model, component.first_command + i);
  }
  const auto starts = [&](const char* state) {
    const auto* parameter =
        node.parameters().find(fmt::format("hardware_components_initial_state.{}", state));
    const auto& names = std::get<std::vector<std::string>>(parameter->value);
    return std::find(names.begin(), names.end(), component.name) != names.end();
  };
  const HardwareState target = starts("unconfigured") ? HardwareState::unconfigured
                               : starts("inactive")   ? HardwareState::inactive
                                                      : HardwareState::active;
  return set_hardware_state(component.name, target);
}

Status ControllerManager::Impl::set_hardware_state(const std::string& name, HardwareState target) {
  ResourceTable::Component* component = resources.find_component(name);
  if (component == nullptr) {
    std::vector<std::string> names;
    for (const auto& candidate : resources.components()) names.push_back(candidate->name);
    return Status::refused(
        fmt::format("there is no hardware component '{}'{}", name, did_you_mean(name, names)));
  }
  if (component->state == target) return {};
  for (const std::string& holder : component->claimed_by) {
    if (holder.empty()) continue;
    return Status::refused(
        fmt::format("the controller '{}' uses hardware '{}'; deactivate it first", holder, name));
  }
  Status status;
  while (status && component->state != target) status = pass_towards(*component, target);
  publish_activity();
  return status;
}

// A call of a component that is not active. Of a name without a component the reason is that of a
// transition.
Status ControllerManager::Impl::without_drives(const std::string& name, const char* during,
                                               const std::function<Status(HardwareComponent&)>& call) {
  ResourceTable::Component* const component = resources.find_component(name);
  if (component == nullptr) return set_hardware_state(name, HardwareState::inactive);
  if (component->state != HardwareState::inactive)
    return Status::refused(fmt::format("hardware '{}' is {}; it has to be inactive for this", name,
                                       to_string(component->state)));
  Status out = Status::refused(fmt::format("hardware '{}' has failed", name));
  resources.call(*component, during, [&](HardwareComponent& hardware) { out = call(hardware); });
  return out;
}

Status ControllerManager::Impl::release_joint(const JointRelease& release) {
  if (stopped) return Status::refused("the emergency stop is active, and the joints hold; reset it first");
  std::vector<std::string> joints;
  for (const auto& component : resources.components()) {
    for (const InterfaceDescription& command : component->command_descriptions) {
      if (command.name != kPosition) continue;
      joints.push_back(command.prefix);
      if (command.prefix != release.joint) continue;
      if (component->state != HardwareState::active)
        return Status::refused(fmt::format("hardware '{}' is {}; it has to be active for this",
                                           component->name, to_string(component->state)));
      Status out = Status::refused(fmt::format("hardware '{}' has failed", component->name));
      resources.call(*component, "the release of a joint",
                     [&](HardwareComponent& hardware) { out = hardware.release_joint(release); });
      return out;
    }
  }
  return Status::refused(fmt::format("no hardware takes positions of '{}'{}", release.joint,
                                     did_you_mean(release.joint, joints)));
}

// One transition of the life cycle.
Status ControllerManager::Impl::pass_towards(ResourceTable::Component& c, HardwareState target) {
  HardwareComponent& hardware = *c.hardware;
  if (c.state == HardwareState::finalized) {
    return Status::refused(fmt::format("hardware '{}' is finalized{}; restart doppel to use it again", c.name,
                                       c.why.empty() ? "" : " (" + c.why + ")"));
  }
  if (target == HardwareState::finalized)
    return pass(c, target, "shut down", [&] { return hardware.on_shutdown(); });
  if (c.state == HardwareState::unconfigured)
    return pass(c, HardwareState::inactive, "configured", [&] { return hardware.on_configure(); });
  if (c.state == HardwareState::active)
    return pass(c, HardwareState::inactive, "deactivated", [&] { return hardware.on_deactivate(); });
  if (target == HardwareState::unconfigured)
    return pass(c, target, "cleaned up", [&] { return hardware.on_cleanup(); });
  forget_commands(c);
  const Status status = pass(c, target, "activated", [&] { return hardware.on_activate(); });
  if (!status) return status;
  guarded.note_activation();
  note_fault(c, "");
  c.not_finite_reported = false;
  if (stopped) stop_component(c);
  resources.read_all(now);
  return {};
}

// Whatever was commanded before an activation or a stop is not written after it: the joints may have moved.
void ControllerManager::Impl::forget_commands(ResourceTable::Component& c) {
  ResourceTable::forget_commands(c);
  for (std::size_t i = 0; i < c.command_names.size(); ++i) limiter.forget(c.first_command + i);
}

Status ControllerManager::Impl::pass(ResourceTable::Component& c, HardwareState next, const char* participle,
                                     const std::function<Status()>& transition) {
  try {
    if (const Status status = transition(); !status) {
      return Status::refused(fmt::format("hardware '{}' cannot be {}: {}", c.name, participle, status.why()));
    }
    c.state = next;
    return {};
  } catch (...) {
    const std::string why = fmt::format("it cannot be {}: {}", participle, thrown_text());
    enter_error(c, why);
    return Status::refused(fmt::format("hardware '{}' is now {}: {}", c.name, to_string(c.state), why));
  }
}

// ros2_control's error processing: a component that recovers is unconfigured, any other finalized.
void ControllerManager::Impl::enter_error(ResourceTable::Component& c, const std::string& why) {
  const Status recovered = attempt([&] { return c.hardware->on_error(); });
  c.state = recovered ? HardwareState::unconfigured : HardwareState::finalized;
  note_fault(c, recovered ? why : fmt::format("{}; recovery failed: {}", why, recovered.why()));
}

// Publishes the reason: in the parameter `fault` of the component's node and on /diagnostics.
void ControllerManager::Impl::note_fault(ResourceTable::Component& c, const std::string& why) {
  if (c.why == why) return;
  c.why = why;
  const auto its_node = hardware_nodes.find(c.name);
  if (its_node == hardware_nodes.end()) return;
  Parameters& parameters = its_node->second->parameters();
  if (parameters.find(kFault) == nullptr)
    parameters.declare(kFault, std::string(), {"why it is not active; empty: no failure", true, {}});
  parameters.update_read_only(kFault, why);
}

// Controllers read such a state as it is: only they know which of their joints they can do without.
void ControllerManager::Impl::report_not_finite() {
  for (const ResourceTable::Component* c : resources.take_not_finite()) {
    const std::size_t state = *c->not_finite;
    log.warning(
        options.name,
        fmt::format("hardware '{}' reads {} of '{}'; controllers that use this state stand still or fail "
                    "until it is finite again (check the encoder and its wiring, or export no state "
                    "that the driver does not measure)",
                    c->name, c->states[state], c->state_names[state]));
  }
}

void ControllerManager::Impl::settle(Time the_time) {
  if (resources.has_not_finite()) report_not_finite();
  if (!resources.has_fault() && !controller_failed) return;
  now = the_time;
  settle_controllers();
  for (const auto& [component, fault] : resources.take_faults()) settle(*component, fault);
}

void ControllerManager::Impl::settle(ResourceTable::Component& c, const HardwareFault& fault) {
  std::string reason = fault.thrown.data();
  PassiveJoint joints = PassiveJoint::free;
  try {
    if (reason.empty()) reason = c.hardware->fault();
    joints = c.hardware->when_failed();
  } catch (...) {
    reason += thrown_text();
  }
  const std::string why = fmt::format(
      "{} in {}: {}", fault.answer == HardwareReturn::error ? "error" : "deactivation", fault.during, reason);
  std::vector<LoadedController*> users;
  for (LoadedController* controller : active) {
    if (uses(*controller, c)) users.push_back(controller);
  }
  users = with_leaders(std::move(users));
  if (fault.answer == HardwareReturn::error) enter_error(c, why);
  deactivate_all(users);
  if (fault.answer == HardwareReturn::deactivate) {
    note_fault(c, why);
    static_cast<void>(
        pass(c, HardwareState::inactive, "deactivated", [&] { return c.hardware->on_deactivate(); }));
  }
  publish_activity();
  log.error(options.name,
            fmt::format(
                "hardware '{}' is {}: {}; its joints are {}; {}. Once the cause is fixed, activate it with "
                "'doppel control set_hardware_component_state {} active'",
                c.name, to_string(c.state), c.why, to_string(joints),
                users.empty() ? "no controller used it" : fmt::format("deactivated: {}", quoted_names(users)),
                c.name));
  start_fallbacks(users);
}

// A controller whose update throws is stopped like one whose hardware has failed.
void ControllerManager::Impl::settle_controllers() {
  if (!std::exchange(controller_failed, false)) return;
  std::vector<LoadedController*> failed;
  for (LoadedController* c : active) {
    if (c->thrown[0] == '\0') continue;
    failed.push_back(c);
    log.error(options.name, fmt::format("'{}' is deactivated: update() threw: {}", c->name,
                                        std::exchange(c->thrown, {}).data()));
  }
  failed = with_leaders(std::move(failed));
  deactivate_all(failed);
  start_fallbacks(failed);
}

void ControllerManager::Impl::deactivate_all(const std::vector<LoadedController*>& controllers) {
  if (controllers.empty()) return;
  const std::vector<std::string> released = stop_and_write(controllers);
  resources.perform_switch({}, released);
  note_active();
  publish_activity();
}

void ControllerManager::Impl::start_fallbacks(const std::vector<LoadedController*>& failed) {
  for (const LoadedController* c : failed) {
    for (const std::string& name : c->fallback) {
      const LoadedController* fallback = find(name);
      if (fallback != nullptr && fallback->state == ControllerState::active) continue;
      const std::vector<std::string> one{name};
      if (const Status status = switch_controllers(one, {}, Strictness::strict); !status) {
        log.error(options.name, fmt::format("cannot activate the fallback controller '{}' of '{}': {}", name,
                                            c->name, status.why()));
      } else {
        log.warning(options.name, fmt::format("'{}' replaces '{}'", name, c->name));
      }
    }
  }
}

void ControllerManager::Impl::shut_down_hardware() {
  for (const auto& component : resources.components()) {
    if (component->state == HardwareState::finalized) continue;
    if (const Status status = attempt([&] { return component->hardware->on_shutdown(); }); !status)
      log.error(options.name,
                fmt::format("hardware '{}' failed to shut down: {}", component->name, status.why()));
  }
}

// As in ros2_control, each component has a node with its name in lower case.
void ControllerManager::Impl::make_hardware_node(const std::string& component) {
  std::string name;
  for (const char c : component) {
    const bool allowed = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
    name += allowed ? static_cast<char>(std::tolower(static_cast<unsigned char>(c))) : '_';
  }
  const std::string whole = expand_name(name, node.given_name());
  // A controller of the same name has the node.
  const auto all = declared();
  if (std::ranges::any_of(all, [&](const auto& controller) { return controller.first == name; })) return;
  const auto taken = bus.nodes();
  if (!check_node_name(name) || std::find(taken.begin(), taken.end(), bus.names().node(whole)) != taken.end())
    return;
  Node& its_node = *hardware_nodes.emplace(component, std::make_unique<Node>(bus, whole)).first->second;
  make_standard(its_node);
  serve_logger_levels(its_node);
}

}  // namespace doppel
