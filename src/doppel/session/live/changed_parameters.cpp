#include "doppel/session/live/detail/changed_parameters.h"

#include <algorithm>

#include "doppel/ros/bus/parameter_services.h"
#include "doppel/scenario/schema/robot_names.h"

namespace doppel {

void ChangedParameters::keep(const rcl_interfaces::msg::ParameterEvent& event) {
  drop_missing_nodes();
  bus_.each_node([&](Node& node) {
    if (node.name() != event.node) return;
    for (const auto& parameter : event.changed_parameters) {
      const Parameters::Declared* const present = node.parameters().find(parameter.name);
      if (present != nullptr && present->value == from_msg(parameter.value))
        values_[{node.name(), present->name}] = present->value;
    }
  });
}

void ChangedParameters::drop_missing_nodes() {
  if (std::exchange(graph_, bus_.graph_version()) == bus_.graph_version()) return;
  const std::vector<std::string> nodes = bus_.nodes();  // sorted
  std::erase_if(values_,
                [&](const auto& one) { return !std::ranges::binary_search(nodes, one.first.first); });
}

std::vector<NamedParameter> ChangedParameters::values_of(const std::string& name_space,
                                                         const std::vector<std::string>& controllers) const {
  std::vector<NamedParameter> out;
  bus_.each_node([&](Node& node) {
    const auto is_this = [&](const std::string& name) {
      return in_namespace(name_space, name) == node.name();
    };
    const auto controller = std::ranges::find_if(controllers, is_this);
    if (controller == controllers.end()) return;
    for (const auto& [place, value] : values_) {
      if (place.first != node.name()) continue;
      const Parameters::Declared* const present = node.parameters().find(place.second);
      if (present != nullptr && present->value == value) out.push_back({*controller, place.second, value});
    }
  });
  return out;
}

}  // namespace doppel
