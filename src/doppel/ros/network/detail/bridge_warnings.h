#pragma once
// Private to the bridge: warnings of its nodes about incompatible endpoints of others. The
// bridge's thread only.

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/ros/network/graph.h"

namespace doppel::ros2 {

using NameProcess = std::function<std::string(int process)>;  // BridgeOptions::name_process

class NetworkWarnings {
 public:
  NetworkWarnings(const Log& log, NameProcess name_process)
      : log_(log), name_process_(std::move(name_process)) {}
  // Logs under the node concerned, once for each pair of endpoints: a reader or writer with incompatible QoS,
  // with rclcpp's message, and another publisher of this participant's clock; once for each participant: a
  // message type of another distribution. `own` is this participant.
  void look_at(const std::vector<GraphTopic>& topics, const std::vector<GraphService>& services,
               const Gid& own);

 private:
  void compare_types(const std::string& name, const std::vector<GraphEndpoint>& own_ends,
                     const std::vector<GraphEndpoint>& other_ends, const char* part, const Gid& self);
  void say(const GraphEndpoint& own_end, const GraphEndpoint& other_end, const std::string& text);
  void compare(const std::string& topic, const GraphEndpoint& publisher, const GraphEndpoint& subscription,
               const Gid& own);
  // True if it was not logged before; recorded as long as the pair exists.
  bool is_new(const GraphEndpoint& own_end, const GraphEndpoint& other_end);

  const Log& log_;
  const NameProcess name_process_;
  std::set<std::pair<Gid, Gid>> said_, lasting_;  // own endpoint, other endpoint
  // Participants of another distribution by their prefix: reported, and those that are there now.
  std::set<std::vector<std::uint8_t>> foreign_, lasting_foreign_;
};

// The process of another participant, as far as its Gid identifies it: "process 1234 on this machine", or
// what it is; "another machine". With Fast DDS a Gid contains the vendor, the machine and the process.
std::string place_of(const Gid& other, const Gid& own, const NameProcess& name_process = {});

}  // namespace doppel::ros2
