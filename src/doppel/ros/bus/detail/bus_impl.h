#pragma once
// Private to the bus: the graph of topics, services and nodes, and the loop's end of an edge.

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>

#include "doppel/ros/bus/bus.h"

namespace doppel::bus_detail {

// The header before the CDR form in an edge's ring; 24 bytes, so that the CDR form is aligned to eight. In place of
// the CDR form there may be a SharedCdr, which the reader takes over.
struct RecordHeader {
  TopicId topic = 0;
  std::uint32_t shared = 0;  // 1: a SharedCdr follows
  std::int64_t stamp = 0;
  std::uint32_t sequence = 0, latched = 0;  // as in Edge::Incoming
};
static_assert(sizeof(RecordHeader) == 24);
using SharedCdr = std::shared_ptr<const Bytes>;

// The SharedCdr of a record, which is destroyed there; the record must not be read again.
inline SharedCdr take_shared(std::span<const std::byte> record) {
  auto* placed =
      const_cast<SharedCdr*>(reinterpret_cast<const SharedCdr*>(record.data() + sizeof(RecordHeader)));
  SharedCdr taken = std::move(*placed);
  std::destroy_at(placed);
  return taken;
}
inline RecordHeader header_of(std::span<const std::byte> record) {
  RecordHeader header;
  std::memcpy(&header, record.data(), sizeof(header));
  return header;
}

// The shared state of the loop and an edge: the ring, and the wake-up of the edge. The reader sets `armed`
// when it has found the ring empty; the writer that clears it signals, so that a busy reader costs the loop
// no system call.
class EdgeLink {
 public:
  EdgeLink(Bus& bus, std::string name, const EdgeOptions& options)
      : bus_(bus),
        name_(std::move(name)),
        options_(options),
        ring_(options.ring_bytes),
        fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (fd_ < 0)
      throw std::system_error(errno, std::generic_category(), "cannot create an eventfd for an edge");
  }
  ~EdgeLink() {
    for (auto record = ring_.front(); record.data() != nullptr; record = ring_.front()) {
      if (header_of(record).shared != 0) take_shared(record);
      ring_.pop();
    }
    close(fd_);
  }
  EdgeLink(const EdgeLink&) = delete;
  EdgeLink& operator=(const EdgeLink&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] ByteRing& ring() { return ring_; }
  [[nodiscard]] const ByteRing& ring() const { return ring_; }
  // True if a topic is to be delivered: the edge's last request, which may overtake earlier ones in another
  // lane.
  void set_wanted(TopicId topic, bool on) {
    const std::lock_guard lock(topics_mutex_);
    if (on) {
      topics_.insert(topic);
    } else {
      topics_.erase(topic);
    }
  }
  [[nodiscard]] bool is_wanted(TopicId topic) {
    const std::lock_guard lock(topics_mutex_);
    return topics_.contains(topic);
  }
  // The loop: whether the edge still exists; a request in another lane than its end may come later.
  [[nodiscard]] bool is_removed() const { return removed_; }
  void set_removed() { removed_ = true; }
  void wake_when_served(bool on) { waits_for_service_ = on; }
  // The loop: wakes the edge if it waits for its requests to be served.
  void served() {
    if (waits_for_service_.load()) signal();
  }
  [[nodiscard]] std::size_t waiting_bytes() const {
    return ring_.used() + shared_bytes_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] bool fits_in_ring(std::size_t size) const { return size + 64 < options_.ring_bytes; }
  [[nodiscard]] bool is_listed() const { return options_.listed; }
  [[nodiscard]] bool reports_conversions() const { return options_.reports_conversions; }
  [[nodiscard]] bool is_network() const { return options_.is_network; }
  [[nodiscard]] bool wants_from(const void* sender) const { return sender != this || options_.receives_own; }

  // The loop: room for a message's CDR form behind its header; empty: no room. Then commit().
  std::span<std::byte> begin(Time stamp, std::size_t size, RecordHeader header) {
    const auto record = ring_.begin_write(sizeof(RecordHeader) + size);
    if (record.empty()) {
      bus_.add_skipped(1);
      return {};
    }
    header.stamp = nanoseconds_of(bus_.stamp(stamp));
    std::memcpy(record.data(), &header, sizeof(header));
    return record.subspan(sizeof(header));
  }
  void commit(std::size_t size) {
    ring_.commit(sizeof(RecordHeader) + size);
    // Both sides use exchange(): either this side finds `armed` set, or the reader finds the record.
    if (armed_.exchange(false, std::memory_order_acq_rel)) signal();
  }
  // The loop: a message that is encoded already, without a copy.
  void push_shared(const Topic& topic, Time stamp, const SharedCdr& cdr) {
    // The records are small, what they share is not: an edge may lag by as many bytes as its ring has.
    if (shared_bytes_.load(std::memory_order_relaxed) + cdr->size() >
        std::max(options_.ring_bytes, 2 * cdr->size())) {
      bus_.add_skipped(1);
      return;
    }
    const auto room =
        begin(stamp, sizeof(SharedCdr), {.topic = topic.id, .shared = 1, .sequence = topic.sequence});
    if (room.empty()) return;
    new (room.data()) SharedCdr(cdr);
    shared_bytes_.fetch_add(cdr->size(), std::memory_order_relaxed);
    commit(sizeof(SharedCdr));
  }
  // The edge: the SharedCdr of the record at the front.
  SharedCdr take(std::span<const std::byte> record) {
    SharedCdr taken = take_shared(record);
    shared_bytes_.fetch_sub(taken->size(), std::memory_order_relaxed);
    return taken;
  }
  void signal() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = write(fd_, &one, sizeof(one));  // full: already signalled
  }

  // The edge: the oldest record; if there is none, the next one will signal.
  std::span<const std::byte> front_or_arm() {
    if (const auto record = ring_.front(); record.data() != nullptr) return record;
    armed_.exchange(true, std::memory_order_acq_rel);
    return ring_.front();
  }
  void drain() const {
    std::uint64_t count = 0;
    [[maybe_unused]] const auto got = read(fd_, &count, sizeof(count));
  }

 private:
  Bus& bus_;
  const std::string name_;
  const EdgeOptions options_;
  ByteRing ring_;
  const int fd_;
  std::atomic<bool> armed_{true};
  std::atomic<bool> waits_for_service_{false};
  bool removed_ = false;
  std::mutex topics_mutex_;
  std::set<TopicId> topics_;
  std::atomic<std::size_t> shared_bytes_{0};  // of records that share their messages
};

// The latched publishers with a message later than that number, the oldest message first.
std::vector<const Endpoint*> latched_messages(const Topic& topic, std::uint32_t after);

}  // namespace doppel::bus_detail

namespace doppel {

struct Bus::Impl {
  Impl(Bus& owner, BusOptions&& options)
      : bus(owner), report(std::move(options.report)), advise(std::move(options.advise)) {}

  using Topic = bus_detail::Topic;
  using ServiceEntry = bus_detail::ServiceEntry;
  using ServiceEntries = std::map<std::string, std::shared_ptr<const ServiceEntry>, std::less<>>;

  // The graph as others are notified of it.
  struct GraphReport {
    std::vector<TopicInfo> topics;
    std::vector<ServiceInfo> services;
    std::vector<std::string> nodes;
    ServiceEntries entries;
  };

  Bus& bus;
  const std::function<void(const std::string&)> report;   // BusOptions::report
  const std::function<void(const std::string&)> advise;   // BusOptions::advise
  std::set<std::pair<std::string, std::string>> advised;  // topic, publisher
  mutable std::mutex mutex;                               // publish() never takes it
  std::map<TopicId, std::shared_ptr<Topic>> topics;  // also held by publishers, which may outlive their node
  TopicId next_topic = 1;
  std::map<std::string, std::shared_ptr<Topic>, std::less<>> by_name;  // the present topic of a name
  ServiceEntries services;
  ServiceId next_service = 1;
  std::vector<Node*> nodes;
  std::atomic<ServiceEvents> service_events{ServiceEvents::off};
  // Outcomes that wait for Bus::run_outcome(), by their work, and whether they do. Any thread.
  std::mutex outcomes_mutex;
  std::condition_variable outcome_came;
  std::multimap<std::string, Inbox::Task> outcomes;
  bool holds_outcomes = false;
  // While a stage is open (stage.h), the graph for all threads except the one that opened it.
  std::unique_ptr<const GraphReport> before_stage;
  std::thread::id stages;

  // Any thread; the mutex is held.
  [[nodiscard]] GraphReport graph_report() const;
  // null: what is there now.
  [[nodiscard]] const GraphReport* graph_before_stage() const {
    return std::this_thread::get_id() == stages ? nullptr : before_stage.get();
  }

  // The loop's thread; all take the mutex.
  std::shared_ptr<Topic> topic_for_node(const std::string& name, const bus_detail::TopicOps& ops,
                                        const std::string& node);
  // nullptr: nodes use the topic with another type.
  std::shared_ptr<Topic> topic_for_edge(const std::string& name, const TypeSupport& support);
  void remove_publisher(const std::string& topic, const void* owner, const std::string& node);
  void add_endpoint(Topic& topic, bool publishes, bus_detail::Endpoint endpoint);
  void advertise(Topic& topic, bus_detail::Endpoint publisher);
  void subscribe_link(TopicId id, const std::shared_ptr<bus_detail::EdgeLink>& link);
  void unsubscribe_link(TopicId id, const std::shared_ptr<bus_detail::EdgeLink>& link);
  void remove_owner(const void* owner);  // a node or a link, with all of its endpoints
  void receive(Topic& topic, std::span<const std::byte> cdr, std::shared_ptr<const void> message,
               const bus_detail::EdgeLink* from);
  void explain_twist(const std::string& who, const std::string& topic, std::string_view came);
  // Keeps an edge's next message for late joiners, if its publisher of that name is latched; before
  // receive().
  void keep(Topic& topic, const bus_detail::EdgeLink* sender, const std::string& node,
            std::span<const std::byte> cdr);
  void deliver_last(TopicId id, const std::shared_ptr<bus_detail::EdgeLink>& link);
  // Delivers those of the publishers with a later sequence number.
  void deliver_last_after(TopicId id, const std::shared_ptr<bus_detail::EdgeLink>& link, std::uint32_t after);
  Edge::SharedParameters all_parameters();
  void offer_events(const ServiceEntry& service);  // if no node uses the topic with another type

  // The loop's thread. The event of a request is published, and that of the response when it is answered, if
  // service events are on. Spans are CDR forms.
  std::shared_ptr<bus_detail::PendingReply> with_events(const std::shared_ptr<const ServiceEntry>& service,
                                                        const CallOrigin& origin,
                                                        std::span<const std::byte> request,
                                                        std::shared_ptr<bus_detail::PendingReply> reply);
  void publish_event(const ServiceEntry& service, std::uint8_t kind, const CallOrigin& origin,
                     std::span<const std::byte> request, std::span<const std::byte> response);

  // The service that an edge has found or, if that was removed, the present one of the same name and type.
  // The loop's thread.
  std::shared_ptr<const ServiceEntry> serving(const std::string& name,
                                              const std::weak_ptr<const ServiceEntry>& found,
                                              decltype(ServiceEntry::decode) decode) const;
  // The part of the node that has the parameter; without one, any part; nullptr: no such node.
  Node* find_node(std::string_view name, std::string_view parameter) const;
  [[nodiscard]] Inbox& inbox() const { return bus.inbox_; }
  void graph_changed() { bus.graph_version_.fetch_add(1, std::memory_order_acq_rel); }
  static void update_wanted(Topic& topic);

 private:
  std::shared_ptr<Topic> make_topic(const std::string& name, const TypeSupport& support);
  // Frees the topic if no node, edge or publisher has it any more. The mutex is held.
  void free_if_unused(TopicId id);
  template <class Change>
  void change_endpoints(Topic& topic, Change change);
  static bool is_listed(const Topic& topic) {
    return !topic.publishers.empty() || !topic.subscribers.empty();
  }

  Edge::SharedParameters
      parameters_;  // the copy for edges, of these versions of the graph and of all parameters
  std::uint64_t graph_of_parameters_ = 0, changes_of_parameters_ = 0;
};

std::unique_ptr<Edge> make_edge(Bus& bus, Bus::Impl& impl, std::string name, const EdgeOptions& options);

}  // namespace doppel
