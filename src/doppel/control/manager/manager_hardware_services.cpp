// The hardware components on the bus: their list, and the changes of their states.

#include <fmt/format.h>

#include "doppel/control/manager/detail/controller_manager.h"
#include "doppel/control/manager/detail/manager_messages.h"

namespace doppel {

namespace srv = controller_manager_msgs::srv;
namespace msg = controller_manager_msgs::msg;

void ControllerManager::Impl::serve_hardware() {
  node.serve<srv::ListHardwareComponents>("~/list_hardware_components", [this](const auto&, auto respond) {
    srv::ListHardwareComponents::Response response;
    for (const auto& component : resources.components()) {
      msg::HardwareComponentState state;
      state.name = component->name;
      state.type = state.class_type = component->type;
      state.plugin_name = component->plugin;
      state.rw_rate = whole_hertz(component->rw_rate);
      state.is_async = component->is_async;
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
        target ? set_hardware_state(request.name, *target)
               : Status::refused(fmt::format(
                     "'{}' ({}) is not a hardware state: unconfigured, inactive, active, finalized",
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

}  // namespace doppel
