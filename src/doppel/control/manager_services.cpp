// The controller manager on the bus: ros2_control's services and its activity topic. A service never throws;
// what went wrong goes to the log, since most of ros2_control's responses carry no more than "ok".

#include <fmt/format.h>

#include <cctype>
#include <cmath>

#include "doppel/bus/standard_node.h"
#include "doppel/control/controller_manager_detail.h"
#include "doppel/core/names.h"
#include "doppel/messages/std_msgs.h"

namespace doppel {
namespace {

namespace srv = controller_manager_msgs::srv;
namespace msg = controller_manager_msgs::msg;
using LifecycleState = lifecycle_msgs::msg::State;

LifecycleState lifecycle(ControllerState state) {
  LifecycleState out;
  out.id = state == ControllerState::active     ? LifecycleState::PRIMARY_STATE_ACTIVE
           : state == ControllerState::inactive ? LifecycleState::PRIMARY_STATE_INACTIVE
                                                : LifecycleState::PRIMARY_STATE_UNCONFIGURED;
  out.label = to_string(state);
  return out;
}

LifecycleState lifecycle(HardwareState state) {
  LifecycleState out;
  out.id = state == HardwareState::active     ? LifecycleState::PRIMARY_STATE_ACTIVE
           : state == HardwareState::inactive ? LifecycleState::PRIMARY_STATE_INACTIVE
                                              : LifecycleState::PRIMARY_STATE_UNCONFIGURED;
  out.label = to_string(state);
  return out;
}

// Either the number or the label says which state is meant; the label wins where both do, as in ros2_control.
std::optional<HardwareState> wanted_state(const LifecycleState& state) {
  for (const HardwareState candidate :
       {HardwareState::unconfigured, HardwareState::inactive, HardwareState::active}) {
    const LifecycleState as_message = lifecycle(candidate);
    if (state.label.empty() ? state.id == as_message.id : state.label == as_message.label) return candidate;
  }
  return std::nullopt;
}

std::uint16_t whole_hertz(double rate) {
  return static_cast<std::uint16_t>(std::lround(std::min(rate, 65535.0)));
}

// ros2_control calls what inactive hardware offers available too, though nobody can be activated on it.
bool is_listed_available(HardwareState state) {
  return state != HardwareState::unconfigured;
}

msg::HardwareInterface interface_message(const std::string& name, bool available, bool claimed) {
  return {name, "double", available, claimed};
}

}  // namespace

void ControllerManager::Impl::serve() {
  activity = node.advertise<msg::ControllerManagerActivity>("~/activity", {.depth = 1, .latched = true});
  // Only to be seen in the graph: the description is at hand.
  node.subscribe<std_msgs::msg::String>("robot_description", [](const auto&) {},
                                        {.depth = 1, .latched = true});
  serve_lists();
  serve_life_cycle();
  serve_hardware();
  publish_activity();
}

void ControllerManager::Impl::serve_lists() {
  node.serve<srv::ListControllers>("~/list_controllers", [this](const auto&, auto respond) {
    srv::ListControllers::Response response;
    for (const auto& c : loaded) {
      msg::ControllerState state;
      state.name = c->name;
      state.state = to_string(c->state);
      state.type = c->type;
      state.update_rate = whole_hertz(c->context.update_rate);
      if (c->state == ControllerState::active) state.claimed_interfaces = c->commands;
      state.required_command_interfaces = c->commands;
      state.required_state_interfaces = c->states;
      response.controller.push_back(std::move(state));
    }
    respond(response);
  });
  node.serve<srv::ListControllerTypes>("~/list_controller_types", [this](const auto&, auto respond) {
    srv::ListControllerTypes::Response response;
    for (const std::string& name : registry.names()) {
      response.types.push_back(name);
      response.base_classes.push_back(registry.find(name)->base_class);
    }
    respond(response);
  });
  node.serve<srv::ListHardwareInterfaces>("~/list_hardware_interfaces", [this](const auto&, auto respond) {
    srv::ListHardwareInterfaces::Response response;
    for (std::size_t i = 0; i < resources.command_count(); ++i) {
      response.command_interfaces.push_back(interface_message(
          resources.command_name(i), is_listed_available(resources.component_of_command(i).state),
          !resources.claimed_by(i).empty()));
    }
    const auto states = resources.state_names();
    for (std::size_t i = 0; i < states.size(); ++i) {
      response.state_interfaces.push_back(interface_message(states[i], resources.state_available(i), false));
    }
    respond(response);
  });
}

void ControllerManager::Impl::serve_life_cycle() {
  // Runs `work`, which may throw InputError or be refused; true: done.
  const auto attempt = [this](const char* what, const std::string& name, const auto& work) {
    std::string why;
    try {
      const Status status = work();
      if (status) return true;
      why = status.why();
    } catch (const std::exception& problem) {
      why = problem.what();
    }
    log.error(options.name, fmt::format("cannot {} '{}': {}", what, name, why));
    return false;
  };
  node.serve<srv::LoadController>("~/load_controller", [this, attempt](const auto& request, auto respond) {
    respond({attempt("load", request.name, [&] {
      load(request.name, "");
      return Status{};
    })});
  });
  node.serve<srv::ConfigureController>("~/configure_controller",
                                       [this, attempt](const auto& request, auto respond) {
                                         respond({attempt("configure", request.name, [&] {
                                           configure(at(request.name));
                                           return Status{};
                                         })});
                                       });
  node.serve<srv::CleanupController>(
      "~/cleanup_controller", [this, attempt](const auto& request, auto respond) {
        respond({attempt("clean up", request.name, [&] { return cleanup(request.name); })});
      });
  node.serve<srv::UnloadController>(
      "~/unload_controller", [this, attempt](const auto& request, auto respond) {
        respond({attempt("unload", request.name, [&] { return unload(request.name); })});
      });
  // Libraries are loaded once, at the start; there is nothing to load anew.
  node.serve<srv::ReloadControllerLibraries>(
      "~/reload_controller_libraries", [this](const auto&, auto respond) {
        log.warning(options.name, "controllers' libraries cannot be reloaded; end doppel and start it again");
        respond({false});
      });
  node.serve<srv::SwitchController>("~/switch_controller", [this](const auto& request, auto respond) {
    const auto& by_default = node.parameters().find("defaults.switch_controller.strictness")->value;
    const bool strict = request.strictness == srv::SwitchController::Request::STRICT ||
                        (request.strictness == 0 && std::get<std::string>(by_default) == "strict");
    const Strictness strictness = strict ? Strictness::strict : Strictness::best_effort;
    Status status;
    bool nothing_to_do = false;
    try {
      status = switch_controllers(request.activate_controllers, request.deactivate_controllers, strictness,
                                  &nothing_to_do);
    } catch (const std::exception& problem) {
      status = Status::refused(problem.what());
    }
    if (!status) log.error(options.name, fmt::format("cannot switch controllers: {}", status.why()));
    const std::string done =
        nothing_to_do ? "After checking the controllers, no controllers need to be activated or deactivated."
                      : "Successfully switched controllers!";
    respond({status.ok(), status.ok() ? done : status.why()});
  });
}

void ControllerManager::Impl::serve_hardware() {
  node.serve<srv::ListHardwareComponents>("~/list_hardware_components", [this](const auto&, auto respond) {
    srv::ListHardwareComponents::Response response;
    for (const auto& component : resources.components()) {
      msg::HardwareComponentState state;
      state.name = component->system->name();
      state.type = state.class_type = "system";
      state.plugin_name = component->system->plugin();
      state.rw_rate = whole_hertz(1.0 / to_seconds(period));
      state.state = lifecycle(component->state);
      const bool available = is_listed_available(component->state);
      for (std::size_t i = 0; i < component->command_names.size(); ++i) {
        state.command_interfaces.push_back(
            interface_message(component->command_names[i], available, !component->claimed_by[i].empty()));
      }
      for (const std::string& name : component->state_names) {
        state.state_interfaces.push_back(interface_message(name, available, false));
      }
      response.component.push_back(std::move(state));
    }
    respond(response);
  });
  node.serve<srv::SetHardwareComponentState>("~/set_hardware_component_state", [this](const auto& request,
                                                                                      auto respond) {
    const auto target = wanted_state(request.target_state);
    const Status status =
        target
            ? set_hardware_state(request.name, *target)
            : Status::refused(fmt::format("hardware can be unconfigured, inactive or active, not '{}' ({})",
                                          request.target_state.label, request.target_state.id));
    if (!status)
      log.error(options.name, fmt::format("cannot set the state of '{}': {}", request.name, status.why()));
    srv::SetHardwareComponentState::Response response;
    response.ok = status.ok();
    if (const auto* component = resources.find_component(request.name))
      response.state = lifecycle(component->state);
    respond(response);
  });
}

Status ControllerManager::Impl::set_hardware_state(const std::string& name, HardwareState target) {
  ResourceTable::Component* component = resources.find_component(name);
  if (component == nullptr) {
    std::vector<std::string> names;
    for (const auto& candidate : resources.components()) names.push_back(candidate->system->name());
    return Status::refused(fmt::format("there is no hardware '{}'{}", name, did_you_mean(name, names)));
  }
  if (component->state == target) return {};
  for (const std::string& holder : component->claimed_by) {
    if (holder.empty()) continue;
    return Status::refused(
        fmt::format("the controller '{}' drives hardware '{}'; deactivate it first", holder, name));
  }
  if (target == HardwareState::active) {
    if (Status status = component->system->activate(); !status) {
      component->state = HardwareState::inactive;
      return Status::refused(fmt::format("hardware '{}' cannot be activated: {}", name, status.why()));
    }
    component->state = target;
    component->system->read(now, period, component->states);
  } else {
    if (component->state == HardwareState::active) {
      if (Status status = component->system->deactivate(); !status) {
        return Status::refused(fmt::format("hardware '{}' cannot be deactivated: {}", name, status.why()));
      }
    }
    component->state = target;
  }
  publish_activity();
  return {};
}

// Each component has a node of its own, named after it in small letters; it offers what every node does.
void ControllerManager::Impl::make_hardware_node(const std::string& component) {
  std::string name;
  for (const char c : component) {
    const bool allowed = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
    name += allowed ? static_cast<char>(std::tolower(static_cast<unsigned char>(c))) : '_';
  }
  const std::string whole = expand_name(name, node.given_name());
  const auto taken = bus.nodes();
  if (!check_node_name(name) || std::find(taken.begin(), taken.end(), bus.names().node(whole)) != taken.end())
    return;
  hardware_nodes.push_back(std::make_unique<Node>(bus, whole));
  make_standard(*hardware_nodes.back());
  serve_logger_levels(*hardware_nodes.back());
}

void ControllerManager::Impl::publish_activity() {
  msg::ControllerManagerActivity message;
  message.header.stamp = to_time_msg(bus.ros_now());
  for (const auto& c : loaded) message.controllers.push_back({c->name, lifecycle(c->state)});
  for (const auto& component : resources.components()) {
    message.hardware_components.push_back({component->system->name(), lifecycle(component->state)});
  }
  activity.publish(message, bus.now());
}

}  // namespace doppel
