#pragma once
// The distributions of ROS 2 that peers have, by the type hashes of their endpoints (ros/messages/distro.h).
// A peer of another distribution is matched by the names of topic and type alone, and its messages would be
// misread.

#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/messages/distro.h"
#include "doppel/ros/network/graph.h"

namespace doppel::ros2 {

// A message type of an endpoint, and the distributions in which it has the endpoint's hash.
struct ForeignType {
  std::string type;             // "control_msgs/msg/PidState", "std_srvs/srv/Trigger_Request"
  std::vector<Distro> distros;  // empty: none, so it is a definition of the peer's own
};

// nullopt: it is as in this process's distribution, or nothing is known of it: no hash, or a type that is
// unknown here. `part` is "" for a topic, "_Request" or "_Response" for an end of a service.
DOPPEL_API std::optional<ForeignType> foreign_type(const GraphEndpoint& endpoint, const char* part);

// The newest distribution that all endpoints fit which are not of the participant `self`; nullopt: they fit
// the process's, or no single one.
DOPPEL_API std::optional<Distro> distro_of_peers(const std::vector<GraphTopic>& topics,
                                                 const std::vector<GraphService>& services, const Gid& self);

// "ROS 2 Kilted or Lyrical"
DOPPEL_API std::string title_of(const std::vector<Distro>& distros);

}  // namespace doppel::ros2
