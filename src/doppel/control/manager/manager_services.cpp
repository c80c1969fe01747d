// The controller manager on the bus: ros2_control's services and its activity topic. A service never throws;
// errors go to the log, because most of ros2_control's responses contain only "ok".

#include <fmt/format.h>

#include "doppel/control/manager/detail/controller_manager.h"
#include "doppel/control/manager/detail/manager_messages.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {

namespace srv = controller_manager_msgs::srv;
namespace msg = controller_manager_msgs::msg;

void ControllerManager::Impl::serve() {
  activity = node.advertise<msg::ControllerManagerActivity>("~/activity", {.depth = 1, .latched = true});
  // Only for the graph, as in ros2_control: the description is already loaded.
  node.subscribe<std_msgs::msg::String>("robot_description", [](const auto&) {},
                                        {.depth = 1, .latched = true});
  serve_lists();
  serve_life_cycle();
  serve_hardware();
  serve_stop();
  serve_diagnostics();
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
      state.reference_interfaces = c->controller->reference_interfaces();
      state.is_chainable = !state.reference_interfaces.empty();
      state.is_chained = c->chained;
      state.chain_connections = chain_connections(*c);
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
    for (const std::size_t i : resources.commands()) {
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
  // Runs `work`, which may throw InputError or be refused; true: successful.
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
  // Libraries are loaded once, at the start, so that there is nothing to reload.
  node.serve<srv::ReloadControllerLibraries>(
      "~/reload_controller_libraries", [this](const auto&, auto respond) {
        log.warning(options.name, "controller libraries cannot be reloaded; restart doppel");
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

void ControllerManager::Impl::publish_activity() {
  msg::ControllerManagerActivity message;
  message.header.stamp = to_time_msg(bus.ros_now());
  for (const auto& c : loaded) message.controllers.push_back({c->name, lifecycle(c->state)});
  for (const auto& component : resources.components()) {
    message.hardware_components.push_back({component->name, lifecycle(component->state)});
  }
  activity.publish(message, bus.now());
}

}  // namespace doppel
