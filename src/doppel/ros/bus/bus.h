#pragma once
// In-process topics, services and parameters by ROS name and type. The loop's thread owns the bus: nodes are
// used on it, and their callbacks run on it between steps. Edges (WebSocket, DDS, recorder) attach from other
// threads: published messages reach them through a lock-free ring each, and their messages and requests reach
// the loop through its inbox.
//
// publish() neither allocates nor locks, and costs a load and a branch without subscribers.

#include <array>
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

#include "doppel/base/core/byte_ring.h"
#include "doppel/base/core/inbox.h"
#include "doppel/base/core/status.h"
#include "doppel/base/core/time.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus_input.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/ros/bus/parameters.h"
#include "doppel/ros/messages/codec.h"

namespace doppel {

class Bus;
class Node;
namespace bus_detail {
struct Topic;
struct TopicOps;
struct ServiceEntry;
}  // namespace bus_detail

// The quality of service of a node's endpoint, as in ROS 2, without deadline and liveliness.
struct Qos {
  std::size_t depth = 10;    // of the history
  bool latched = false;      // transient local: the last message is kept for late joiners
  bool best_effort = false;  // else reliable
  bool keep_all = false;     // the history has no depth

  // Transient local on a network, which keeps the history itself; the bus keeps no message for late joiners.
  bool latched_on_network = false;
  Duration lifespan{};  // of a message on a network, in wall-clock time; zero: unlimited

  // The profiles of ROS 2. System defaults are those of Jazzy's middleware (Fast DDS).
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

// The events of services' calls that are published on <service>/_service_event, as by rcl's service introspection:
// nothing (there are no such topics), who calls and when, or the requests and responses as well.
enum class ServiceEvents { off, metadata, contents };

// Who has called a service, for its events: the DDS GUID of the client's writer, and the number of the
// request.
struct CallOrigin {
  std::array<std::uint8_t, 16> client{};
  std::int64_t sequence = 0;
};

using TopicId = std::uint32_t;
using ServiceId = std::uint32_t;

// A publisher or subscriber: a node of the bus, or a participant behind an edge.
struct EndpointInfo {
  std::string node;  // "/arm"; behind an edge, the name that the edge gives it
  std::string edge;  // the name of its edge; empty: a node of the bus
  Qos qos;           // as requested by the node; behind an edge, the default
};

struct TopicInfo {
  TopicId id = 0;
  std::string name, type;
  bool latched = false;  // the last message of a publisher is kept for late joiners
  std::vector<EndpointInfo> publishers, subscribers;  // each node once
  std::uint64_t received = 0;                         // messages from edges
};

struct ServiceInfo {
  ServiceId id = 0;
  std::string name, type, node;
  bool yields = false;  // Node::set_yielding
};

// Responds to a service request once, now or later, on the loop's thread. Copyable.
template <class Response>
using Responder = std::function<void(const Response&)>;
// The same with the CDR form of the response, which another thread may have made: the loop does not copy it.
using EncodedResponder = std::function<void(Bytes)>;

template <Message M>
class Publisher {
 public:
  Publisher() = default;
  void publish(const M& message, Time stamp) const;  // the loop's thread only
  // A message that another thread has encoded: edges share its bytes, so that a picture costs the loop no
  // copy. Precondition: `cdr` is the CDR form of an M.
  void publish_encoded(const std::shared_ptr<const Bytes>& cdr, Time stamp) const;
  [[nodiscard]] bool has_listeners() const;  // false: publishing would have no effect

 private:
  friend class Node;
  Publisher(std::shared_ptr<bus_detail::Topic> topic, const Node* node)
      : topic_(std::move(topic)), node_(node) {}
  std::shared_ptr<bus_detail::Topic> topic_;
  const Node* node_ = nullptr;  // compared only: the handle may outlive it
};

// A named participant: "/omarm_arm_controller". Its destructor removes its topics, services and parameters.
// The loop's thread only. The bus outlives the node. All names are subject to the bus's rules (name_rules.h),
// so that the graph shows them after `--ros-args -r`.
class DOPPEL_API Node {
 public:
  Node(Bus& bus, std::string_view name);  // with its leading slash, before the rules
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }              // "/left/arm"
  [[nodiscard]] const std::string& given_name() const { return given_name_; }  // before the rules: "/arm"
  [[nodiscard]] Bus& bus() const { return bus_; }

  // "~/x" is below the node, "/x" absolute, "x" in the node's namespace. Throw std::logic_error if nodes use
  // the topic with another type.
  template <Message M>
  Publisher<M> advertise(std::string_view topic, Qos qos = {});
  template <Message M>
  void subscribe(std::string_view topic, std::function<void(const M&)> callback, Qos qos = {});
  // Serving a name again replaces the node's own handler; throws std::logic_error if another node serves it.
  // If the handler throws, or all copies of the responder are destroyed uncalled, the caller gets an error.
  template <Service S>
  void serve(std::string_view service,
             std::function<void(const typename S::Request&, Responder<typename S::Response>)> handler);

  template <Service S>
  void serve_encoded(std::string_view service,
                     std::function<void(const typename S::Request&, EncodedResponder)> handler);

  [[nodiscard]] Parameters& parameters() { return parameters_; }

  // Its services stand in for those of a program that may run beside this one: on a network they step back
  // where that program serves their names. Before the first of them.
  void set_yielding() { yielding_ = true; }
  [[nodiscard]] bool is_yielding() const { return yielding_; }

 private:
  std::shared_ptr<bus_detail::Topic> advertise_topic(std::string_view topic, const bus_detail::TopicOps& ops,
                                                     Qos qos);
  void subscribe_topic(std::string_view topic, const bus_detail::TopicOps& ops,
                       std::function<void(const void*)> callback, Qos qos);
  void serve_entry(std::string_view service, bus_detail::ServiceEntry entry);

  Bus& bus_;
  std::string given_name_, name_;
  Parameters parameters_;
  bool yielding_ = false;
};

struct EdgeOptions {
  std::size_t ring_bytes = std::size_t{8} << 20;  // how much it may lag before messages are dropped for it
  // True if an edge that subscribes to a topic also gets its own messages. A network must not get them back.
  bool receives_own = true;
  // The edge logs converted messages itself, by the names of their publishers behind it (BusOptions::advise).
  bool reports_conversions = false;
  // Its subscriptions are part of the graph. False: an observer of the process itself.
  bool listed = true;
  // It passes on what other programs publish. A topic that a node of the bus publishes is this program's
  // own: what others publish on it reaches the nodes that subscribe, and no other edge.
  bool is_network = false;
};

// The interface of an edge: all functions are called from the edge's one thread, wake() from any. The bus
// outlives the edge; later replies are dropped, and none runs during or after its destruction.
class DOPPEL_API Edge {
 public:
  virtual ~Edge() = default;

  // The requests below run on the loop's thread in their order, within the time that the loop has for edges
  // (Bus::set_edge_share). An edge for many clients gives each an own lane, because lanes get equal shares
  // of this time. make_lane() is a lane that wakes the edge after its tasks while wake_when_served() is
  // set. act_for: the lane of all following requests; nullptr: the edge's own.
  [[nodiscard]] virtual std::shared_ptr<Inbox::Lane> make_lane() = 0;
  virtual void act_for(std::shared_ptr<Inbox::Lane> lane) = 0;
  virtual void wake_when_served(bool on) = 0;
  // Runs a task on the loop's thread, after the earlier requests of its lane.
  virtual void post(std::function<void()> task) = 0;

  // Takes effect at the loop's next step. Latched topics then deliver the last message of each of their
  // publishers, also to an edge that is subscribed already. The last of these calls is valid, in whatever
  // lane.
  virtual void subscribe(TopicId topic) = 0;
  virtual void unsubscribe(TopicId topic) = 0;

  // Takes the oldest message; `cdr` is valid until the next call. False: there is none.
  struct Incoming {
    TopicId topic = 0;
    Time stamp{};
    std::span<const std::byte> cdr;
    std::uint32_t sequence = 0;  // counts the topic's messages from 1 on: a gap is a loss
    // 0: a new message. Else a latched one from before subscribe(): the number of those that are still to
    // come for that call, including this one.
    std::uint32_t latched = 0;
  };
  virtual bool next(Incoming& message) = 0;
  // Waits until there is a message, wake() is called or the time is over.
  virtual void wait(std::chrono::milliseconds at_most) = 0;
  virtual void wake() = 0;
  // A file descriptor for event loops that becomes readable when there is a message; drained by next().
  [[nodiscard]] virtual int readable_fd() const = 0;
  [[nodiscard]] virtual std::uint64_t dropped() const = 0;
  [[nodiscard]] virtual std::size_t waiting_bytes() const = 0;  // of messages that next() has not taken

  // Publishes a message on the bus as node `from`. Refuses an unknown type, a type other than the topic's,
  // and malformed bytes. Subscribers get it at the loop's next step; this edge too, unless
  // EdgeOptions::receives_own is false.
  virtual Status publish(std::string_view from, std::string_view topic, std::string_view type,
                         std::span<const std::byte> cdr) = 0;
  // The node will publish on the topic with these qualities; of a latched topic, late joiners get the last
  // message. Refuses like publish().
  virtual Status advertise(std::string_view node, std::string_view topic, std::string_view type,
                           const Qos& qos) = 0;
  // Node `from` publishes no longer on the topic. A topic that no one uses any more is freed.
  virtual void unadvertise(std::string_view from, std::string_view topic) = 0;
  // Calls a service; `reply` is called on the loop's thread with the response's CDR, or the reason
  // for its absence.
  virtual void call_from(const CallOrigin& origin, std::string_view service,
                         std::span<const std::byte> request_cdr,
                         std::function<void(Status, Bytes)> reply) = 0;
  void call(std::string_view service, std::span<const std::byte> request_cdr,
            std::function<void(Status, Bytes)> reply) {
    call_from({}, service, request_cdr, std::move(reply));
  }
  // Parameters of nodes, "/node" and "name"; `reply` is called on the loop's thread. All of them are one
  // copy, shared by all edges until a parameter changes; of the requested ones, those that do not exist are
  // absent.
  using SharedParameters = std::shared_ptr<const std::vector<NamedParameter>>;
  virtual void get_parameters(std::function<void(const SharedParameters&)> reply) = 0;
  virtual void get_parameters(std::vector<std::pair<std::string, std::string>> nodes_and_names,
                              std::function<void(const SharedParameters&)> reply) = 0;
  virtual void set_parameter(std::string_view node, std::string_view name, const ParameterValue& value,
                             std::function<void(Status)> reply) = 0;
};

// What an edge does with a geometry_msgs Twist for a topic where nodes read TwistStamped, or the reverse
// (twist_conversion.h): refuses it like any other type, refuses it and explains, or converts it and explains.
enum class TwistPolicy { refuse, explain, convert };

struct BusOptions {
  NameRules names = {};
  // True if messages are stamped with simulated time, which is published on /clock; else with wall-clock
  // time. All times within the process (now(), update(), publish()) are simulated time in both cases.
  bool sim_time = true;
  // Called with the text of the first exception of each topic's subscribers, and the loop continues. Empty:
  // exceptions leave publish() and spin(), as a user program expects.
  std::function<void(const std::string&)> report = {};
  TwistPolicy twists = TwistPolicy::refuse;
  // Called once for each topic and publisher of such messages, with the explanation. The loop's thread.
  std::function<void(const std::string&)> advise = {};
};

class DOPPEL_API Bus {
 public:
  explicit Bus(BusOptions options = {});
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  // -- the loop's thread
  // Runs the tasks of other threads, and those of edges within their share of time; returns their number.
  // Called between steps. The fast path is one load.
  std::size_t spin() { return inbox_.empty() ? 0 : run_tasks(); }
  // The share of the thread's time for the requests of edges, which otherwise could delay the loop; those
  // beyond it wait for a later spin(). 0, the default: all run at once.
  void set_edge_share(double share) { edge_share_ = share; }
  // For a loop without steps: waits until spin() has a task, or the time is over (false).
  bool wait(std::chrono::nanoseconds at_most) { return inbox_.wait(at_most); }
  void set_now(Time now) { now_ = now; }
  [[nodiscard]] Time now() const { return now_; }
  [[nodiscard]] NameRules& names() { return names_; }
  [[nodiscard]] bool sim_time() const { return sim_time_; }
  [[nodiscard]] TwistPolicy twists() const { return twists_; }
  // The lowest level of lines on /rosout by the logger's name, in rcl's numbers. The loop's thread.
  [[nodiscard]] std::map<std::string, std::uint32_t>& logger_levels() { return logger_levels_; }
  // Conversion between the loop's time and a header's stamp. With wall-clock stamps they differ by
  // set_stamp_offset(), which changes while time is paused or has another speed.
  [[nodiscard]] Time stamp(Time here) const { return here + stamp_offset_; }
  [[nodiscard]] Time from_stamp(Time there) const { return there - stamp_offset_; }
  [[nodiscard]] Time ros_now() const { return stamp(now_); }
  void set_stamp_offset(Duration offset) { stamp_offset_ = offset; }

  // Also for the services that are offered later; the loop's thread, not while a stage is open (stage.h). The
  // events' topics are hidden ones of the services' nodes.
  void set_service_events(ServiceEvents what);
  [[nodiscard]] ServiceEvents service_events() const;

  // -- inputs as values; set before others attach
  // The observer is called with each input right before the loop acts on it.
  void observe_inputs(std::function<void(const BusInput&)> observer) { observer_ = std::move(observer); }
  // An input that does not come by an edge, right before it acts.
  void report_input(const BusInput& input) const {
    if (observer_) observer_(input);
  }
  // From now on the outcomes of complete() wait for run_outcome(), so that they act when they did before.
  void hold_outcomes();
  // Runs the outcome of this work, once it is there. False: it did not come in time.
  bool run_outcome(const std::string& work, std::chrono::milliseconds at_most);

  // Visits every node, or every part of a node.
  void each_node(const std::function<void(Node&)>& visit) const;

  // -- any thread
  void post(Inbox::Task task) { inbox_.post(std::move(task)); }
  // The outcome of work that an input has started on another thread: an input of its own, because it acts
  // when it is there. `work`: the same in every run, "spawn 1".
  void complete(std::string work, Inbox::Task task);
  [[nodiscard]] std::vector<TopicInfo> topics() const;
  [[nodiscard]] std::vector<ServiceInfo> services() const;
  [[nodiscard]] std::vector<std::string> nodes() const;  // sorted
  // Increases with every change of topics, their nodes, services or nodes, so that edges detect changes.
  [[nodiscard]] std::uint64_t graph_version() const { return graph_version_.load(std::memory_order_acquire); }
  // The number of messages that edges or their clients missed because they did not keep up: messages that
  // found an edge's ring full, and those that edges have skipped for their clients.
  [[nodiscard]] std::uint64_t skipped() const { return skipped_.load(std::memory_order_relaxed); }
  void add_skipped(std::uint64_t messages) { skipped_.fetch_add(messages, std::memory_order_relaxed); }
  std::unique_ptr<Edge> attach(std::string name, EdgeOptions options = {});

  struct Impl;

 private:
  friend class Node;
  friend class BusStage;
  std::size_t run_tasks();

  NameRules names_;
  const bool sim_time_;
  const TwistPolicy twists_;
  std::map<std::string, std::uint32_t> logger_levels_;
  Inbox inbox_;
  double edge_share_ = 0;
  std::chrono::nanoseconds allowance_{};  // for the requests of edges; negative after a slow one
  std::chrono::steady_clock::time_point allowed_until_{};
  Time now_{};
  Duration stamp_offset_{};
  std::atomic<std::uint64_t> graph_version_{0};
  std::atomic<std::uint64_t> skipped_{0};
  std::function<void(const BusInput&)> observer_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel

#include "doppel/ros/bus/detail/bus.h"
