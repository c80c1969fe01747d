#pragma once
// Private to the bridge: the services of a bus as servers on the network, and its nodes' clients of others'
// services. The bridge's thread only, unless noted.

#include <atomic>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "doppel/ros/network/detail/bridge_topics.h"

namespace doppel::ros2 {

// Passes a task to the bridge's thread; any thread. Tasks that have not run at its end are dropped.
using PostToBridge = std::function<void(std::function<void()>)>;

class BridgedServices {
 public:
  BridgedServices(Edge& edge, Participant& participant, NetworkStatus& status, RejectionLog& rejections,
                  UnbridgedLog& unbridged, PostToBridge post_to_bridge)
      : edge_(edge),
        participant_(participant),
        status_(status),
        rejections_(rejections),
        unbridged_(unbridged),
        post_to_bridge_(std::move(post_to_bridge)) {}

  // See BridgedTopics::follow.
  bool follow(const std::vector<ServiceInfo>& services, SteadyTime now);
  // Requests to the bus, a limited number; true: there may be more.
  bool take();
  // Sends responses whose clients were not reachable before; true: some still wait.
  bool retry(SteadyTime now);
  void announce(Announcement& announcement) const;

 private:
  struct Key {
    std::string name, type, node;
    friend auto operator<=>(const Key&, const Key&) = default;
  };
  struct Served {
    std::shared_ptr<ServiceServer> server;
    std::shared_ptr<std::size_t> calls = std::make_shared<std::size_t>(0);  // unanswered
    bool seen = true;
    SteadyTime gone_since{};
  };
  struct Answer {
    std::weak_ptr<ServiceServer> server;
    SampleIdentity to;
    Bytes cdr;
    SteadyTime made;
    std::shared_ptr<Backlog::Share> share;
  };
  void call(const Key& key, Served& served);
  void finish(const Key& key, const Served& served, const SampleIdentity& to, const Status& status,
              Bytes response);
  bool respond(const Answer& answer, SteadyTime now);

  Edge& edge_;
  Participant& participant_;
  NetworkStatus& status_;
  RejectionLog& rejections_;
  UnbridgedLog& unbridged_;
  PostToBridge post_to_bridge_;
  std::map<Key, Served> services_;
  std::deque<Answer> waiting_;
  Backlog calls_, answers_;  // those that wait: for the loop, and for their clients
  Sample request_;
  std::shared_ptr<char> alive_ = std::make_shared<char>();  // responses may arrive after the destruction
};

// The shared state of a RemoteService and the bridge.
struct ClientCore {
  std::string node;
  ServiceSpec service;
  std::atomic<bool> available{false};

  std::mutex mutex;
  std::uint64_t next_call = 1;
  std::map<std::uint64_t, RemoteService::Reply> replies;  // of the calls that are waited for

  // The loop's thread.
  void reply(std::uint64_t call, Bytes response);
};

class BridgedClients {
 public:
  BridgedClients(Bus& bus, Edge& edge, NetworkStatus& status, UnbridgedLog& unbridged)
      : bus_(bus), edge_(edge), status_(status), unbridged_(unbridged) {}

  // nullptr: the network cannot be used, calls only go to the bus. Ends everything of the former participant.
  void set_participant(Participant* participant);
  // Services that the bus itself has.
  void follow(const std::vector<ServiceInfo>& services);
  void add(std::shared_ptr<ClientCore> core);
  void remove(const std::shared_ptr<ClientCore>& core);
  void call(const std::shared_ptr<ClientCore>& core, std::uint64_t number, Bytes request);
  // Replies to the loop; true: there may be more.
  bool take();
  // See BridgedTopics::is_held_back.
  [[nodiscard]] bool is_held_back() const { return backlog_.is_full(); }
  void match();
  void announce(Announcement& announcement) const;
  // True if clients were added or removed since the last call.
  [[nodiscard]] bool has_changed() { return std::exchange(changed_, false); }

 private:
  struct Client {
    std::unique_ptr<ServiceClient> client;       // null: no participant
    std::map<std::int64_t, std::uint64_t> sent;  // the request's number on the network: the call's
  };
  void connect(ClientCore& core, Client& client);

  Bus& bus_;
  Edge& edge_;
  NetworkStatus& status_;
  UnbridgedLog& unbridged_;
  Participant* participant_ = nullptr;
  std::set<std::string, std::less<>> local_;
  std::map<std::shared_ptr<ClientCore>, Client> clients_;
  bool changed_ = false;
  Backlog backlog_;
  Sample reply_;
};

}  // namespace doppel::ros2
