#pragma once
// Private to the bridge: the names of yielding nodes (Node::set_yielding) that other programs serve as well.
// The bridge's thread only.

#include <map>
#include <set>
#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/ros/network/bridge.h"
#include "doppel/ros/network/detail/bridge_warnings.h"

namespace doppel::ros2 {

class YieldedNames {
 public:
  YieldedNames(Yielding policy, NameProcess name_process, const Log& log)
      : policy_(policy), name_process_(std::move(name_process)), log_(log) {}

  // The services of the bus.
  void follow(const std::vector<ServiceInfo>& services);
  // The graph has changed. `self` is this participant. True: other names are hidden than before.
  bool look_at(const std::vector<GraphNode>& nodes, const std::vector<GraphService>& services,
               const Gid& self);

  // Not offered on the network.
  [[nodiscard]] bool hides(const ServiceInfo& service) const { return hidden_.contains(service.name); }
  // Its endpoints belong to another node there.
  [[nodiscard]] bool hides_node(const std::string& node) const { return hidden_nodes_.contains(node); }

 private:
  void update();
  void log_changes(const std::set<std::string>& before) const;

  const Yielding policy_;
  const NameProcess name_process_;
  const Log& log_;
  std::map<std::string, std::string> services_;  // services of yielding nodes, with their nodes
  std::map<std::string, std::string> others_;    // services of programs that go first, with who serves them
  std::set<std::string> other_nodes_;
  std::set<std::string> hidden_, hidden_nodes_;
};

}  // namespace doppel::ros2
