#pragma once
// In-process topics, services and parameters by ROS name and type. The loop's thread owns the bus: nodes live
// on it, their callbacks run on it between steps. Edges (WebSocket, DDS, recorder) attach from other threads:
// what the loop publishes reaches them through a lock-free ring each, what they send reaches the loop through
// its inbox.
//
// publish() neither allocates nor locks, and costs a load and a branch without subscribers.

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/bus/name_rules.h"
#include "doppel/bus/parameters.h"
#include "doppel/core/byte_ring.h"
#include "doppel/core/inbox.h"
#include "doppel/core/status.h"
#include "doppel/core/time.h"
#include "doppel/export.h"
#include "doppel/messages/codec.h"

namespace doppel {

class Bus;
class Node;
namespace bus_detail {
struct Topic;
struct TopicOps;
struct ServiceEntry;
}  // namespace bus_detail

// What of ROS 2's quality of service a node requests; deadline and liveliness are never requested.
struct Qos {
  std::size_t depth = 10;    // of the history that is kept
  bool latched = false;      // transient local: the last message is kept for late joiners
  bool best_effort = false;  // else reliable
  bool keep_all = false;     // the history has no depth

  // Transient local on a network, which keeps the history itself; the bus keeps nothing for late joiners.
  bool latched_on_network = false;
  Duration lifespan{};  // of a message on a network, by the wall clock; zero: forever

  // The profiles that ROS 2 names. What it leaves to the system is as Jazzy's middleware (Fast DDS) has it.
  static constexpr Qos sensor_data() { return {.depth = 5, .best_effort = true}; }
  static constexpr Qos system_default_publisher() { return {.depth = 1, .latched_on_network = true}; }
  static constexpr Qos system_default_subscription() { return {.depth = 1, .best_effort = true}; }
  static constexpr Qos rosout() {
    return {.depth = 1000, .latched_on_network = true, .lifespan = std::chrono::seconds(10)};
  }
  static constexpr Qos parameter_events() { return {.depth = 1000}; }
  static constexpr Qos clock_subscription() { return {.depth = 1, .best_effort = true}; }

  [[nodiscard]] constexpr bool transient_local() const { return latched || latched_on_network; }

  bool operator==(const Qos&) const = default;
};

using TopicId = std::uint32_t;
using ServiceId = std::uint32_t;

// One who publishes or subscribes: a node of the bus, or somebody beyond an edge.
struct EndpointInfo {
  std::string node;  // "/arm"; beyond an edge, what the edge calls it
  std::string edge;  // the name of the edge that it came through; empty: a node of the bus
  Qos qos;           // as the node asked for it; beyond an edge, the default
};

struct TopicInfo {
  TopicId id = 0;
  std::string name, type;
  bool latched = false;                               // the last message is kept for late joiners
  std::vector<EndpointInfo> publishers, subscribers;  // each node once
  std::uint64_t received = 0;                         // messages that edges have sent in
};

struct ServiceInfo {
  ServiceId id = 0;
  std::string name, type, node;
};

// Answers a service request, now or later, once; from the loop's thread. Copyable; unanswered until called.
template <class Response>
using Responder = std::function<void(const Response&)>;

template <Message M>
class Publisher {
 public:
  Publisher() = default;
  void publish(const M& message, Time stamp) const;  // the loop's thread only
  [[nodiscard]] bool has_listeners() const;          // false: publishing would reach nobody and keep nothing

 private:
  friend class Node;
  explicit Publisher(bus_detail::Topic* topic) : topic_(topic) {}
  bus_detail::Topic* topic_ = nullptr;  // lives as long as the bus
};

// A named participant: "/omarm_arm_controller". Destroying it removes all that it offered. The loop's thread
// only. It must go before its bus does. Whatever it names goes through the bus's rules (name_rules.h), so
// that everybody sees what `--ros-args -r` made of it.
class DOPPEL_API Node {
 public:
  Node(Bus& bus, std::string_view name);  // with its leading slash, before the rules
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }              // "/left/arm"
  [[nodiscard]] const std::string& given_name() const { return given_name_; }  // before the rules: "/arm"
  [[nodiscard]] Bus& bus() const { return bus_; }

  // "~/x" is under the node, "/x" absolute, "x" in the node's namespace.
  // Throws std::logic_error if the topic has another type.
  template <Message M>
  Publisher<M> advertise(std::string_view topic, Qos qos = {});
  template <Message M>
  void subscribe(std::string_view topic, std::function<void(const M&)> callback, Qos qos = {});
  // Serving a name again replaces one's own handler; throws std::logic_error if it is another node's. A
  // caller whose responder is dropped unanswered gets an error; so is one whose handler throws.
  template <Service S>
  void serve(std::string_view service,
             std::function<void(const typename S::Request&, Responder<typename S::Response>)> handler);

  [[nodiscard]] Parameters& parameters() { return parameters_; }

 private:
  bus_detail::Topic* advertise_topic(std::string_view topic, const bus_detail::TopicOps& ops, Qos qos);
  void subscribe_topic(std::string_view topic, const bus_detail::TopicOps& ops,
                       std::function<void(const void*)> callback, Qos qos);
  void serve_entry(std::string_view service, bus_detail::ServiceEntry entry);

  Bus& bus_;
  std::string given_name_, name_;
  Parameters parameters_;
};

struct EdgeOptions {
  std::size_t ring_bytes = std::size_t{8} << 20;  // how much it may lag before messages are dropped for it
  // Whether what it sends in comes back to it where it subscribes. A network must not be told what it said.
  bool receives_own = true;
};

// An edge's view: everything here may be called from the edge's one thread, wake() from any. It must go
// before its bus does; replies that come after it are dropped, and none runs while or after it is destroyed.
class DOPPEL_API Edge {
 public:
  virtual ~Edge() = default;

  // Which topics this edge wants; takes effect at the loop's next step. Latched topics then deliver their
  // last message.
  virtual void subscribe(TopicId topic) = 0;
  virtual void unsubscribe(TopicId topic) = 0;

  // The oldest message not yet taken; `cdr` is valid until the next call. False: none.
  struct Incoming {
    TopicId topic = 0;
    Time stamp{};
    std::span<const std::byte> cdr;
  };
  virtual bool next(Incoming& message) = 0;
  // Waits until next() would give something, wake() is called or the time is over.
  virtual void wait(std::chrono::milliseconds at_most) = 0;
  virtual void wake() = 0;
  // A file descriptor that becomes readable when next() would give something (for event loops); drained by
  // next().
  [[nodiscard]] virtual int readable_fd() const = 0;
  [[nodiscard]] virtual std::uint64_t dropped() const = 0;

  // Sends a message in from outside, as node `from`. Refused: a type that nobody knows or that is not the
  // topic's, malformed bytes. Whoever subscribes gets it at the loop's next step; this edge too, unless it
  // was attached as one that does not receive its own messages.
  virtual Status publish(std::string_view from, std::string_view topic, std::string_view type,
                         std::span<const std::byte> cdr) = 0;
  // Calls a service; `reply` runs on the loop's thread with the response's CDR, or the reason why there is
  // none.
  virtual void call(std::string_view service, std::span<const std::byte> request_cdr,
                    std::function<void(Status, Bytes)> reply) = 0;
  // Parameters of nodes, "/node" and "name"; answers on the loop's thread.
  virtual void get_parameters(std::function<void(std::vector<NamedParameter>)> reply) = 0;
  virtual void set_parameter(std::string_view node, std::string_view name, const ParameterValue& value,
                             std::function<void(Status)> reply) = 0;
};

struct BusOptions {
  NameRules names = {};
  // Whether messages are stamped with simulated time, which /clock tells; else with the wall's. Everything on
  // this side of the bus (now(), update(), publish()) is simulated time in either case.
  bool sim_time = true;
  // Where the first exception of each topic's subscribers goes, as text: the loop continues. Empty:
  // exceptions leave publish() and spin(), as in a program of one's own.
  std::function<void(const std::string&)> report = {};
};

class DOPPEL_API Bus {
 public:
  explicit Bus(BusOptions options = {});
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  // -- the loop's thread
  // Runs what edges and other threads have sent; returns how many. Call it between steps. The fast path is
  // one load.
  std::size_t spin() { return inbox_.run(); }
  // For a loop that has no step of its own to make: waits until spin() has something to run, or the time is
  // over (false).
  bool wait(std::chrono::nanoseconds at_most) { return inbox_.wait(at_most); }
  void set_now(Time now) { now_ = now; }
  [[nodiscard]] Time now() const { return now_; }
  [[nodiscard]] NameRules& names() { return names_; }
  [[nodiscard]] bool sim_time() const { return sim_time_; }
  // By the logger's name, rcl's levels: below it, nothing reaches /rosout. The loop's thread.
  [[nodiscard]] std::map<std::string, std::uint32_t>& logger_levels() { return logger_levels_; }
  // What a message's header says of a time here, and back. With the wall clock they lie set_stamp_offset()
  // apart, which changes while time stands or runs at another speed.
  [[nodiscard]] Time stamp(Time here) const { return here + stamp_offset_; }
  [[nodiscard]] Time from_stamp(Time there) const { return there - stamp_offset_; }
  [[nodiscard]] Time ros_now() const { return stamp(now_); }
  void set_stamp_offset(Duration offset) { stamp_offset_ = offset; }

  // Every node, or every part of one.
  void each_node(const std::function<void(Node&)>& visit) const;

  // -- any thread
  void post(Inbox::Task task) { inbox_.post(std::move(task)); }
  [[nodiscard]] std::vector<TopicInfo> topics() const;
  [[nodiscard]] std::vector<ServiceInfo> services() const;
  [[nodiscard]] std::vector<std::string> nodes() const;  // sorted
  // Grows whenever a topic or who has it, a service or a node comes or goes, so that edges can tell.
  [[nodiscard]] std::uint64_t graph_version() const { return graph_version_.load(std::memory_order_acquire); }
  // Messages that did not reach the edges that had requested them, because they do not keep up: what found an
  // edge's ring full, and what edges say they skipped for clients of theirs.
  [[nodiscard]] std::uint64_t skipped() const { return skipped_.load(std::memory_order_relaxed); }
  void add_skipped(std::uint64_t messages) { skipped_.fetch_add(messages, std::memory_order_relaxed); }
  std::unique_ptr<Edge> attach(std::string name, EdgeOptions options = {});

  struct Impl;

 private:
  friend class Node;
  friend class BusStage;
  NameRules names_;
  const bool sim_time_;
  std::map<std::string, std::uint32_t> logger_levels_;
  Inbox inbox_;
  Time now_{};
  Duration stamp_offset_{};
  std::atomic<std::uint64_t> graph_version_{0};
  std::atomic<std::uint64_t> skipped_{0};
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel

#include "doppel/bus/detail/bus.h"
