#pragma once
// Private to the bridge: what its nodes warn of when others come whom they cannot work with. The bridge's
// thread only.

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "doppel/core/log.h"
#include "doppel/ros2/graph.h"

namespace doppel::ros2 {

class NetworkWarnings {
 public:
  explicit NetworkWarnings(const Log& log) : log_(log) {}
  // Says, as the node that it is about and once for each pair of endpoints: that a reader or writer with
  // incompatible QoS has come, in rclcpp's words; that somebody else publishes this participant's clock, too.
  // `own` is this participant.
  void look_at(const std::vector<GraphTopic>& topics, const Gid& own);

 private:
  void say(const GraphEndpoint& own_end, const GraphEndpoint& other_end, const std::string& text);
  void compare(const std::string& topic, const GraphEndpoint& publisher, const GraphEndpoint& subscription,
               const Gid& own);
  // Whether it has not been said before; it is not forgotten while the pair lasts.
  bool is_new(const GraphEndpoint& own_end, const GraphEndpoint& other_end);

  const Log& log_;
  std::set<std::pair<Gid, Gid>> said_, lasting_;  // own endpoint, other endpoint
};

// Where the other participant runs, as far as its Gid tells: "process 1234 on this machine", "another
// machine". Fast DDS writes its vendor, the machine and the process into it.
std::string place_of(const Gid& other, const Gid& own);

}  // namespace doppel::ros2
