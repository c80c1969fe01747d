#pragma once
// The nodes on the network and their endpoints, as rmw_dds_common combines them from DDS discovery and the
// topic ros_discovery_info (rmw_dds_common/msg/ParticipantEntitiesInfo, transient local).

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2 {

struct GraphNode {
  std::string name;  // "/ns/name"
  Gid participant;
  std::string enclave;
  std::vector<Gid> readers, writers;
};

// A node of this participant with its endpoints.
struct OwnNode {
  std::string name;  // "/ns/name"
  std::vector<Gid> readers{}, writers{};
};

inline constexpr const char* kUnknownNode = "_NODE_NAME_UNKNOWN_";  // as in ROS 2

struct GraphEndpoint {
  // "/ns/name"; without a node kUnknownNode, or "_CREATED_BY_BARE_DDS_APP_" if its participant is not
  // of ROS 2.
  std::string node;
  std::string type;  // "sensor_msgs/msg/JointState"
  std::string type_hash;
  QosProfile qos;
  Gid gid;
};

struct GraphTopic {
  std::string name;  // "/joint_states"
  std::vector<GraphEndpoint> publishers, subscriptions;
};

struct GraphService {
  std::string name;
  // The ends of its requests, and those of its replies. Types are the service's: "std_srvs/srv/Trigger";
  // hashes are those of the request and of the response.
  std::vector<GraphEndpoint> servers, clients;
  std::vector<GraphEndpoint> reply_servers, reply_clients;
};

class DOPPEL_API Graph {
 public:
  // Announces the own nodes and reads those of others. `participant` outlives the graph. Throws NetworkError.
  explicit Graph(Participant& participant);
  ~Graph();

  // Sets the own nodes, announced if they differ from the last ones. The thread of update().
  void set_own_nodes(std::vector<OwnNode> nodes);

  // Reads received announcements; true: something changed, also by discovery. The thread of
  // the participant's readers.
  bool update();
  // As of the last update(). Sorted by name; a service is listed once, by its requests.
  [[nodiscard]] const std::vector<GraphNode>& nodes() const;
  [[nodiscard]] const std::vector<GraphTopic>& topics() const;
  [[nodiscard]] const std::vector<GraphService>& services() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel::ros2
