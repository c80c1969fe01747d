#include "doppel/ros/network/bridge.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <thread>

#include "doppel/base/core/guarded_thread.h"
#include "doppel/ros/messages/printable.h"
#include "doppel/ros/network/bridge_types.h"
#include "doppel/ros/network/detail/bridge_diagnostics.h"
#include "doppel/ros/network/detail/bridge_mailbox.h"
#include "doppel/ros/network/detail/bridge_services.h"
#include "doppel/ros/network/detail/bridge_topics.h"
#include "doppel/ros/network/detail/bridge_twists.h"
#include "doppel/ros/network/detail/bridge_warnings.h"
#include "doppel/ros/network/detail/bridge_yielding.h"

namespace doppel::ros2 {

// RateLimitedTask and JoinedNetwork are outside of the anonymous namespace, because Bridge::Impl, which
// contains both, has external linkage.

// A task that may be requested at any time, and is run at most once per period.
class RateLimitedTask {
 public:
  explicit RateLimitedTask(std::chrono::milliseconds period) : period_(period) {}
  void request() { requested_ = true; }
  [[nodiscard]] bool is_due(SteadyTime now) {
    if (!requested_ || now < next_) return false;
    requested_ = false;
    next_ = now + period_;
    return true;
  }
  [[nodiscard]] SteadyTime next(SteadyTime otherwise) const {
    return requested_ ? std::min(next_, otherwise) : otherwise;
  }

 private:
  const std::chrono::milliseconds period_;
  bool requested_ = true;
  SteadyTime next_{};
};

// The objects that exist while there is a participant.
struct JoinedNetwork {
  JoinedNetwork(Bus& bus, Edge& edge, std::unique_ptr<Participant> made, NetworkStatus& status,
                RejectionLog& rejections, UnbridgedLog& unbridged, PostToBridge post_to_bridge,
                const Log& log, BridgedTwists::Join join_again)
      : participant(std::move(made)),
        graph(*participant),
        topics(bus, edge, *participant, status, rejections, unbridged),
        twists(bus, edge, status, rejections, log, std::move(join_again)),
        services(edge, *participant, status, rejections, unbridged, std::move(post_to_bridge)) {}

  std::unique_ptr<Participant> participant;
  Graph graph;
  BridgedTopics topics;
  BridgedTwists twists;
  BridgedServices services;
};

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::size_t kMaxPassed = 256;        // messages to the network before other work is done
constexpr milliseconds kIdlePollPeriod{50};    // the bus does not report changes of its graph
constexpr milliseconds kBackpressureDelay{1};  // while waiting for the loop or a client
constexpr milliseconds kDiagnostics{1000};

class RemoteServiceImpl : public RemoteService {
 public:
  RemoteServiceImpl(std::shared_ptr<BridgeMailbox> bridge, BridgedClients& clients,
                    std::shared_ptr<ClientCore> core)
      : bridge_(std::move(bridge)), clients_(clients), core_(std::move(core)) {
    bridge_->post([&all = clients_, added = core_] { all.add(added); });
  }
  ~RemoteServiceImpl() override {
    {
      const std::lock_guard lock(core_->mutex);
      core_->replies.clear();
    }
    bridge_->post([&all = clients_, removed = core_] { all.remove(removed); });
  }

  [[nodiscard]] bool is_available() const override { return core_->available; }

  std::uint64_t call(Bytes request, Reply reply) override {
    std::uint64_t number = 0;
    {
      const std::lock_guard lock(core_->mutex);
      number = core_->next_call++;
      core_->replies[number] = std::move(reply);
    }
    bridge_->post([&all = clients_, core = core_, number, request = std::move(request)]() mutable {
      all.call(core, number, std::move(request));
    });
    return number;
  }

  void forget(std::uint64_t call) override {
    const std::lock_guard lock(core_->mutex);
    core_->replies.erase(call);
  }

 private:
  std::shared_ptr<BridgeMailbox> bridge_;
  BridgedClients& clients_;  // only used by the mailbox's tasks, because it may be destroyed
  std::shared_ptr<ClientCore> core_;
};

}  // namespace

struct Bridge::Impl {
  Impl(Bus& of, BridgeOptions with, const Log& to, MakeParticipant make)
      : bus(of), options(std::move(with)), log(to), make_participant(std::move(make)) {
    if (!options.diagnostics_node.empty()) diagnostics.emplace(bus, options);
    thread = guarded_thread([this] { run(); },
                            [this](const std::string& what) {
                              log.error("ros2",
                                        fmt::format("the ROS 2 bridge stopped after an exception: {}", what));
                            });
  }
  ~Impl() {
    stop = true;
    edge->wake();
    thread.join();
  }

  // The bridge's thread
  void run();
  void join();
  void leave(const std::string& problem);
  bool work(SteadyTime now);
  bool work_with_network(SteadyTime now);
  bool forward_messages();
  void follow_bus(SteadyTime now);
  void announce();
  void take_snapshot();
  void publish_status(SteadyTime now);
  void read_middleware_log();
  void wait(SteadyTime now);

  Bus& bus;
  const BridgeOptions options;
  const Log& log;
  const MakeParticipant make_participant;
  std::unique_ptr<Edge> edge = bus.attach(kBridgeName, {.ring_bytes = options.ring_bytes,
                                                        .receives_own = false,
                                                        .reports_conversions = true,
                                                        .is_network = true});
  std::shared_ptr<BridgeMailbox> mailbox = std::make_shared<BridgeMailbox>(*edge);
  std::optional<NetworkDiagnostics> diagnostics;

  // The bridge's thread only.
  NetworkStatus now_so_far;
  RejectionLog rejections{log, now_so_far};
  UnbridgedLog unbridged{log};
  NetworkWarnings warnings{log, options.name_process};
  YieldedNames yielded{options.yielding, options.name_process, log};
  std::unique_ptr<JoinedNetwork> network;
  BridgedClients clients{bus, *edge, now_so_far, unbridged};
  RateLimitedTask follow{milliseconds(10)}, match{milliseconds(5)}, graph_update{milliseconds(20)},
      status_update{milliseconds(20)}, diagnosis{kDiagnostics};
  std::uint64_t seen_version = ~std::uint64_t{0}, seen_discovery = ~std::uint64_t{0};
  bool look = true, some_wait = false;  // at the readers; for a client or for the loop

  // Shared with the threads of callers.
  mutable std::mutex mutex;
  NetworkStatus status;
  std::shared_ptr<const GraphSnapshot> snapshot = std::make_shared<GraphSnapshot>();
  std::map<std::string, Matches, std::less<>> matches;

  std::atomic<bool> stop{false};
  std::thread thread;  // last
};

void Bridge::Impl::run() {
  join();
  while (!stop) {
    try {
      const auto now = steady_clock::now();
      if (!work(now)) wait(now);
    } catch (...) {
      leave(thrown_text());
    }
  }
  clients.set_participant(nullptr);
  network.reset();
  mailbox->close();
}

void Bridge::Impl::join() {
  try {
    ParticipantOptions with = options.network;
    with.is_cancelled = [this] { return stop.load(); };
    const auto make = [this, with] { return make_participant(with, [box = mailbox] { box->activity(); }); };
    network = std::make_unique<JoinedNetwork>(
        bus, *edge, make(), now_so_far, rejections, unbridged,
        [box = mailbox](auto task) { box->post(std::move(task)); }, log, make);
    clients.set_participant(network->participant.get());
    now_so_far.state = NetworkStatus::State::joined;
  } catch (...) {
    if (!stop) leave(thrown_text());
  }
}

// Without a network clients can still use the bus's own services.
void Bridge::Impl::leave(const std::string& problem) {
  clients.set_participant(nullptr);
  network.reset();
  now_so_far.state = NetworkStatus::State::absent;
  now_so_far.problem = problem;
  log.warning("ros2", fmt::format("no ROS 2 network: {}", problem));
  follow.request();
  status_update.request();
}

bool Bridge::Impl::work(SteadyTime now) {
  const bool had_tasks = mailbox->run();
  if (mailbox->had_activity()) {
    look = true;
    match.request();
    graph_update.request();
  }
  look = look || had_tasks;
  // Work is requested by flags and done at a bounded rate: a launch that makes a hundred topics causes one
  // announcement and not a hundred.
  if (bus.graph_version() != seen_version) follow.request();
  if (follow.is_due(now)) follow_bus(now);
  bool more = network != nullptr && work_with_network(now);
  more = forward_messages() || more;
  if (clients.has_changed() && network != nullptr) announce();
  diagnosis.request();
  publish_status(now);
  return more;
}

bool Bridge::Impl::work_with_network(SteadyTime now) {
  some_wait = network->services.retry(now);
  bool more = false;
  if (look) {
    bool left = network->topics.take();
    left = clients.take() || left;
    left = network->twists.take() || left;
    // Messages that the loop cannot take yet stay in the readers, whose QoS decides what is lost; the
    // thread then waits a millisecond instead of spinning.
    const bool held_back =
        network->topics.is_held_back() || clients.is_held_back() || network->twists.is_held_back();
    more = network->services.take() || (left && !held_back);
    some_wait = some_wait || (left && held_back);
    look = left || more;
    status_update.request();
  }
  if (match.is_due(now)) {
    if (network->topics.match()) match.request();
    clients.match();
    const std::lock_guard lock(mutex);
    matches = network->topics.matches();
  }
  if (graph_update.is_due(now) && network->graph.update()) take_snapshot();
  network->twists.report_unnamed(network->participant->gid(), now);
  return more;
}

// Forwards messages of the loop to the network.
bool Bridge::Impl::forward_messages() {
  Edge::Incoming message;
  for (std::size_t i = 0; i < kMaxPassed; ++i) {
    if (!edge->next(message)) return false;
    if (network != nullptr) network->topics.pass(message);
    status_update.request();
  }
  return true;
}

void Bridge::Impl::follow_bus(SteadyTime now) {
  seen_version = bus.graph_version();  // read first, so that later changes are found next time
  auto services = bus.services();
  clients.follow(services);
  if (network == nullptr) return;
  yielded.follow(services);
  std::erase_if(services, [this](const ServiceInfo& service) { return yielded.hides(service); });
  bool waits = network->topics.follow(bus.topics(), now);
  waits = network->services.follow(services, now) || waits;
  if (waits) follow.request();
  match.request();
  announce();
}

void Bridge::Impl::announce() {
  Announcement announcement;
  for (const std::string& node : bus.nodes()) {
    if (yielded.hides_node(node)) announcement.rename(node, kBridgeName);
    announcement.add_node(node);
  }
  network->topics.announce(announcement);
  network->services.announce(announcement);
  clients.announce(announcement);
  network->graph.set_own_nodes(announcement.nodes());
  graph_update.request();
}

void Bridge::Impl::take_snapshot() {
  auto next = std::make_shared<GraphSnapshot>();
  // Callers of other threads read snapshots, so that they never wait for the network.
  next->nodes = network->graph.nodes();
  next->topics = network->graph.topics();
  next->services = network->graph.services();
  const Gid own = network->participant->gid();
  warnings.look_at(next->topics, next->services, own);
  if (yielded.look_at(next->nodes, next->services, own)) follow.request();
  network->twists.look_at(next->topics, own, steady_clock::now());
  now_so_far.nodes = static_cast<std::size_t>(
      std::ranges::count_if(next->nodes, [&own](const GraphNode& node) { return node.participant != own; }));
  const auto participants = network->participant->participants();
  now_so_far.participants =
      static_cast<std::size_t>(std::ranges::count_if(participants, [&](const ParticipantInfo& participant) {
        return participant.gid != own && !network->twists.is_own(participant.gid);
      }));
  status_update.request();
  const std::lock_guard lock(mutex);
  next->version = snapshot->version + 1;
  snapshot = std::move(next);
}

void Bridge::Impl::publish_status(SteadyTime now) {
  if (status_update.is_due(now)) {
    const std::lock_guard lock(mutex);
    status = now_so_far;
    if (network != nullptr) status.lost += network->topics.lost();
    status.lost += edge->dropped();
  }
  if (!diagnosis.is_due(now)) return;
  if (network != nullptr) read_middleware_log();
  if (diagnostics.has_value()) diagnostics->publish(status);
}

// The middleware continues after the warning; the first one is logged, because it may be the only one.
void Bridge::Impl::read_middleware_log() {
  const bool first = now_so_far.middleware_log.count == 0;
  now_so_far.middleware_log = network->participant->middleware_log();
  now_so_far.middleware_log.latest =
      printable(now_so_far.middleware_log.latest);  // it may contain names of peers
  now_so_far.refused_datagrams = network->participant->refused_datagrams();
  if (first && now_so_far.middleware_log.count > 0)
    log.warning("ros2", fmt::format("Fast DDS warning: {}; further warnings are counted on /diagnostics",
                                    now_so_far.middleware_log.latest));
  status_update.request();
}

void Bridge::Impl::wait(SteadyTime now) {
  SteadyTime until = now + (some_wait ? kBackpressureDelay : kIdlePollPeriod);
  for (const RateLimitedTask* paced : {&follow, &match, &graph_update, &status_update, &diagnosis}) {
    until = paced->next(until);
  }
  edge->wait(std::chrono::ceil<milliseconds>(std::max(until - now, steady_clock::duration{})));
}

Bridge::Bridge(Bus& bus, BridgeOptions options, const Log& log, MakeParticipant make)
    : impl_(std::make_unique<Impl>(bus, std::move(options), log, std::move(make))) {}

Bridge::~Bridge() = default;

NetworkStatus Bridge::status() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->status;
}

std::shared_ptr<const GraphSnapshot> Bridge::graph() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->snapshot;
}

Matches Bridge::matches(std::string_view topic) const {
  const std::lock_guard lock(impl_->mutex);
  const auto found = impl_->matches.find(topic);
  return found == impl_->matches.end() ? Matches{} : found->second;
}

std::unique_ptr<RemoteService> Bridge::make_client(std::string node, std::string_view service,
                                                   std::string_view type) {
  auto core = std::make_shared<ClientCore>();
  core->node = std::move(node);
  core->service = service_spec(service, type);
  return std::make_unique<RemoteServiceImpl>(impl_->mailbox, impl_->clients, std::move(core));
}

}  // namespace doppel::ros2
