#pragma once
// The parameters of all nodes, followed by /parameter_events, so that another thread than the loop has them.

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/parameters.h"
#include "doppel/ros/messages/rcl_interfaces.h"

namespace doppel {

class DOPPEL_API ParameterSnapshot {
 public:
  // The loop's thread. The bus outlives it.
  explicit ParameterSnapshot(Bus& bus);

  // Any thread. Anyone may publish events: the loop's next spin() reads the parameters that they name at
  // their nodes, and what no node has is not kept.
  void apply(const rcl_interfaces::msg::ParameterEvent& event);
  // A ROS 2 parameter file. Any thread.
  [[nodiscard]] std::string text() const;

 private:
  // Shared with the tasks of the loop.
  struct Values {
    void update(const Bus& bus, const std::string& node, const std::vector<std::string>& names);
    void drop_missing_nodes(const Bus& bus);

    std::mutex mutex;
    std::uint64_t graph = 0;  // the version of the last look for nodes that are gone
    std::map<std::string, std::map<std::string, ParameterValue>> by_node;  // by node and name
  };

  Bus& bus_;
  std::shared_ptr<Values> values_ = std::make_shared<Values>();
};

}  // namespace doppel
