#include "doppel/lab/recording/parameter_snapshot.h"

#include "doppel/ros/bus/parameter_file_text.h"
#include "doppel/ros/bus/parameter_services.h"

namespace doppel {

ParameterSnapshot::ParameterSnapshot(const Bus& bus) {
  bus.each_node([this](Node& node) {
    auto& values = values_[node.name()];
    for (const Parameters::Declared& declared : node.parameters().all())
      values[declared.name] = declared.value;
  });
}

void ParameterSnapshot::apply(const rcl_interfaces::msg::ParameterEvent& event) {
  auto& values = values_[event.node];
  for (const auto* list : {&event.new_parameters, &event.changed_parameters}) {
    for (const auto& parameter : *list) values[parameter.name] = from_msg(parameter.value);
  }
  for (const auto& parameter : event.deleted_parameters) values.erase(parameter.name);
}

std::string ParameterSnapshot::text() const {
  std::string out;
  for (const auto& [node, values] : values_) {
    if (!values.empty()) out += parameter_file_text(node, {values.begin(), values.end()});
  }
  return out;
}

}  // namespace doppel
