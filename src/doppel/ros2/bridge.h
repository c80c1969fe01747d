#pragma once
// Joins a bus with ROS 2's network: what the bus's nodes publish, subscribe to and serve is a writer, a
// reader or a server of one DDS participant, announced as that node's; what others send reaches the bus as
// from an edge. Follows the bus: controllers, and with them endpoints, come and go.
//
// A thread of its own does the work; a bus without listeners on the network pays nothing for it.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/bus/bus.h"
#include "doppel/core/log.h"
#include "doppel/export.h"
#include "doppel/ros2/environment.h"
#include "doppel/ros2/graph.h"
#include "doppel/ros2/service.h"

namespace doppel::ros2 {

struct BridgeOptions {
  ParticipantOptions network;
  // The node that tells /diagnostics once a second how the network is, status "doppel: ros2 network"; "":
  // none does.
  std::string diagnostics_node;
  std::size_t ring_bytes = std::size_t{32} << 20;  // how much may wait for the network before it is dropped
};

// How it goes. Counters only grow.
struct NetworkStatus {
  enum class State : std::uint8_t { joining, joined, absent };
  State state = State::joining;
  std::string problem;           // absent: why, in one line
  std::size_t participants = 0;  // others
  std::size_t nodes = 0;         // of others
  std::uint64_t sent = 0, received = 0, requests = 0;
  std::uint64_t refused = 0;     // messages and requests: malformed, or not of the topic's type
  std::uint64_t lost = 0;        // on the way here, as DDS tells, and here, where the loop did not keep up
  std::uint64_t unanswered = 0;  // requests whose client has gone or never came within reach
  struct Rejections {
    std::uint64_t count = 0;
    std::string reason;  // the last one
  };
  std::map<std::string, Rejections> rejections;  // by topic or service
  std::uint64_t refused_datagrams = 0;           // that were no messages of RTPS
  MiddlewareLog middleware_log;                  // of the middleware
};

// Who is on the network, this bus's nodes included; see Graph.
struct GraphSnapshot {
  std::uint64_t version = 0;  // grows with every change
  std::vector<GraphNode> nodes;
  std::vector<GraphTopic> topics;
  std::vector<GraphService> services;
};

// A node's way to a service of others; where the bus itself serves the name, calls go there. Functions may be
// called from any thread. May outlive its bridge: it is then never available.
class DOPPEL_API RemoteService {
 public:
  virtual ~RemoteService() = default;  // on the loop's thread: no reply runs after it
  [[nodiscard]] virtual bool is_available() const = 0;
  // `reply` runs on the loop's thread, once or never (the server may be gone or refuse): forget() what is no
  // longer waited for. Returns the call's number. What is sent before a server is available is lost.
  using Reply = std::function<void(Bytes response)>;
  virtual std::uint64_t call(Bytes request, Reply reply) = 0;
  virtual void forget(std::uint64_t call) = 0;
};

// How many of others a node's endpoints on a topic have found.
struct Matches {
  std::size_t readers = 0;  // and what is published reaches them from now on
  std::size_t writers = 0;
};

class DOPPEL_API Bridge {
 public:
  using MakeParticipant = std::function<std::unique_ptr<Participant>(const ParticipantOptions& options,
                                                                     std::function<void()> on_activity)>;

  // On the loop's thread, as its end. Returns at once; the thread makes the participant. A network that
  // cannot be used is a warning in `log`, which has to take lines from any thread; it and `bus` have to
  // outlive the bridge.
  Bridge(Bus& bus, BridgeOptions options, const Log& log, MakeParticipant make = make_participant);
  // Says goodbye to the network.
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  // -- any thread
  [[nodiscard]] NetworkStatus status() const;
  // Never null; what was there when it was taken.
  [[nodiscard]] std::shared_ptr<const GraphSnapshot> graph() const;
  [[nodiscard]] Matches matches(std::string_view topic) const;
  // A client of `node`, which the network sees among that node's. `service` is an absolute name, `type` one
  // like "std_srvs/srv/Trigger".
  [[nodiscard]] std::unique_ptr<RemoteService> make_client(std::string node, std::string_view service,
                                                           std::string_view type);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel::ros2
