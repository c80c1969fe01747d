#pragma once
// The parameters of all nodes, followed by /parameter_events, so that another thread than the loop has them.

#include <map>
#include <string>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/parameters.h"
#include "doppel/ros/messages/rcl_interfaces.h"

namespace doppel {

class DOPPEL_API ParameterSnapshot {
 public:
  // The loop's thread.
  explicit ParameterSnapshot(const Bus& bus);

  // One thread at a time.
  void apply(const rcl_interfaces::msg::ParameterEvent& event);
  // A ROS 2 parameter file.
  [[nodiscard]] std::string text() const;

 private:
  std::map<std::string, std::map<std::string, ParameterValue>> values_;  // by node and name
};

}  // namespace doppel
