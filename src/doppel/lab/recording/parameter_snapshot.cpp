#include "doppel/lab/recording/parameter_snapshot.h"

#include <algorithm>
#include <utility>

#include "doppel/ros/bus/parameter_file_text.h"

namespace doppel {

ParameterSnapshot::ParameterSnapshot(Bus& bus) : bus_(bus) {
  bus.each_node([this](Node& node) {
    auto& values = values_->by_node[node.name()];
    for (const Parameters::Declared& declared : node.parameters().all())
      values[declared.name] = declared.value;
  });
}

void ParameterSnapshot::apply(const rcl_interfaces::msg::ParameterEvent& event) {
  std::vector<std::string> names;
  for (const auto* list : {&event.new_parameters, &event.changed_parameters, &event.deleted_parameters}) {
    for (const auto& parameter : *list) names.emplace_back(parameter.name);
  }
  bus_.post([&bus = bus_, values = values_, node = std::string(event.node), names = std::move(names)] {
    values->update(bus, node, names);
  });
}

void ParameterSnapshot::Values::update(const Bus& bus, const std::string& node,
                                       const std::vector<std::string>& names) {
  const std::lock_guard lock(mutex);
  drop_missing_nodes(bus);
  std::vector<const Parameters*> parts;
  bus.each_node([&](Node& part) {
    if (part.name() == node) parts.push_back(&part.parameters());
  });
  if (parts.empty()) return;
  auto& values = by_node[node];
  for (const std::string& name : names) {
    values.erase(name);
    for (const Parameters* const part : parts) {
      if (const Parameters::Declared* const present = part->find(name)) values[name] = present->value;
    }
  }
}

void ParameterSnapshot::Values::drop_missing_nodes(const Bus& bus) {
  if (std::exchange(graph, bus.graph_version()) == bus.graph_version()) return;
  const std::vector<std::string> nodes = bus.nodes();  // sorted
  std::erase_if(by_node, [&](const auto& entry) { return !std::ranges::binary_search(nodes, entry.first); });
}

std::string ParameterSnapshot::text() const {
  // The loop waits for this lock, so that it is not held while the text is made.
  const auto by_node = [this] {
    const std::lock_guard lock(values_->mutex);
    return values_->by_node;
  }();
  std::string out;
  for (const auto& [node, values] : by_node) {
    if (!values.empty()) out += parameter_file_text(node, {values.begin(), values.end()});
  }
  return out;
}

}  // namespace doppel
