#pragma once
// The values that parameters got while the twin runs, followed by /parameter_events, for a copy of a robot.
// The loop's thread.

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/rcl_interfaces.h"

namespace doppel {

class ChangedParameters {
 public:
  // The bus outlives it.
  explicit ChangedParameters(const Bus& bus) : bus_(bus) {}

  // Anyone may publish events, so a value that the node does not have is not kept. A value that was set
  // again has an event of its own.
  void keep(const rcl_interfaces::msg::ParameterEvent& event);
  // The values that the controllers of a robot still have; their names are without the namespace.
  [[nodiscard]] std::vector<NamedParameter> values_of(const std::string& name_space,
                                                      const std::vector<std::string>& controllers) const;
  [[nodiscard]] std::size_t count() const { return values_.size(); }

 private:
  void drop_missing_nodes();

  const Bus& bus_;
  std::map<std::pair<std::string, std::string>, ParameterValue> values_;  // by node and parameter
  std::uint64_t graph_ = 0;  // the version of the last look for nodes that are gone
};

}  // namespace doppel
