#pragma once
// Connects a bus to the ROS 2 network: every publication, subscription and service of the bus's nodes is a
// writer, a reader or a server of one DDS participant, announced under its node; received messages reach the
// bus as from an edge. Follows the bus as nodes and endpoints are added and removed.
//
// The work is done on a separate thread; without subscribers on the network the bus has no cost.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/network/environment.h"
#include "doppel/ros/network/graph.h"
#include "doppel/ros/network/service.h"

namespace doppel::ros2 {

// The services of yielding nodes (Node::set_yielding): offered whatever others do, offered unless another
// program serves the name, or not offered on the network.
enum class Yielding : std::uint8_t { never, to_others, always };

struct BridgeOptions {
  ParticipantOptions network = {};
  Yielding yielding = Yielding::to_others;
  // The node that publishes the status "doppel: ros2 network" on /diagnostics once a second; "": none.
  std::string diagnostics_node = {};
  // For warnings about other participants: what a process of this machine is, "the twin kate (port 8700)", or
  // "". Empty: the process's number is printed.
  std::function<std::string(int process)> name_process = {};
  std::size_t ring_bytes = std::size_t{32} << 20;  // queue for the network, beyond which messages are dropped
};

// The bridge's status. Counters only increase.
struct NetworkStatus {
  enum class State : std::uint8_t { joining, joined, absent };
  State state = State::joining;
  std::string problem;           // the reason, in one line, if the network is absent
  std::size_t participants = 0;  // others
  std::size_t nodes = 0;         // of others
  std::uint64_t sent = 0, received = 0, requests = 0;
  std::uint64_t refused = 0;     // messages and requests: malformed, or not of the topic's type
  std::uint64_t lost = 0;        // reported as lost by DDS, or dropped because the loop did not keep up
  std::uint64_t unanswered = 0;  // requests whose client has disappeared or was never reachable
  struct Rejections {
    std::uint64_t count = 0;
    std::string reason;  // the last one
  };
  std::map<std::string, Rejections> rejections;  // by topic or service
  std::uint64_t refused_datagrams = 0;           // not valid messages of RTPS
  MiddlewareLog middleware_log;                  // of the middleware
};

// The nodes on the network, including those of this bus; see Graph.
struct GraphSnapshot {
  std::uint64_t version = 0;  // increases with every change
  std::vector<GraphNode> nodes;
  std::vector<GraphTopic> topics;
  std::vector<GraphService> services;
};

// A node's client of a service on the network; if the bus itself serves the name, calls go there. Any thread.
// May outlive its bridge and is then never available.
class DOPPEL_API RemoteService {
 public:
  virtual ~RemoteService() = default;  // on the loop's thread: no reply runs after it
  [[nodiscard]] virtual bool is_available() const = 0;
  // `reply` is called on the loop's thread, once or never (the server may disappear or refuse); forget()
  // drops a call that is no longer awaited. Returns the call's number. A request without an available
  // server is lost.
  using Reply = std::function<void(Bytes response)>;
  virtual std::uint64_t call(Bytes request, Reply reply) = 0;
  virtual void forget(std::uint64_t call) = 0;
};

// The number of matched endpoints of others for a node's endpoints on a topic.
struct Matches {
  std::size_t readers = 0;  // later messages reach them
  std::size_t writers = 0;
};

class DOPPEL_API Bridge {
 public:
  using MakeParticipant = std::function<std::unique_ptr<Participant>(const ParticipantOptions& options,
                                                                     std::function<void()> on_activity)>;

  // Constructor and destructor: the loop's thread. Returns at once; the bridge's thread makes the
  // participant. An unusable network is a warning in `log`, which must accept lines from any thread; it and
  // `bus` outlive the bridge.
  Bridge(Bus& bus, BridgeOptions options, const Log& log, MakeParticipant make = make_participant);
  // Leaves the network.
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  // -- any thread
  [[nodiscard]] NetworkStatus status() const;
  // A snapshot, never nullptr.
  [[nodiscard]] std::shared_ptr<const GraphSnapshot> graph() const;
  [[nodiscard]] Matches matches(std::string_view topic) const;
  // A client of `node`, announced under that node. `service` is an absolute name, `type` has
  // the form "std_srvs/srv/Trigger".
  [[nodiscard]] std::unique_ptr<RemoteService> make_client(std::string node, std::string_view service,
                                                           std::string_view type);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel::ros2
