#pragma once
// Private to the bridge: the topics of a bus as writers and readers, one for each node that publishes or
// subscribes. The bridge's thread only.

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "doppel/ros/network/bridge.h"
#include "doppel/ros/network/detail/bridge_backlog.h"

namespace doppel::ros2 {

using SteadyTime = std::chrono::steady_clock::time_point;

// The bridge's own name as an edge; hidden, as ROS 2 hides names with a leading underscore.
inline constexpr const char* kBridgeName = "/_ros2";

// The time by which an endpoint outlives its node: a controller that is loaded again keeps its own.
inline constexpr std::chrono::milliseconds kGracePeriod{250};

// Counts refusals, and logs one for each topic and sender.
class RejectionLog {
 public:
  RejectionLog(const Log& log, NetworkStatus& status) : log_(log), status_(status) {}
  void add(const std::string& name, const Gid& sender, const std::string& reason);

 private:
  const Log& log_;
  NetworkStatus& status_;
  std::set<std::pair<std::string, std::vector<std::uint8_t>>> logged_;  // name, participant
};

// Logs, once each, the endpoints of the bus that the network refuses.
class UnbridgedLog {
 public:
  explicit UnbridgedLog(const Log& log) : log_(log) {}
  // False: the network refused, and the caller should try again later.
  template <class Make>
  bool attempt(const std::string& name, const Make& make) {
    try {
      make();
      return true;
    } catch (const NetworkError& e) {
      log(name, e.what());
      return false;
    }
  }

 private:
  void log(const std::string& name, const std::string& reason);
  const Log& log_;
  std::set<std::pair<std::string, std::string>> logged_;
};

// Nodes with their endpoints on the network, to be announced.
class Announcement {
 public:
  // Anything added to a node of that name from now on belongs to the other one.
  void rename(const std::string& name, const std::string& other) { renamed_[name] = other; }
  void add_node(const std::string& name) { of(name); }
  void add_reader(const std::string& node, const Gid& gid) { of(node).readers.push_back(gid); }
  void add_writer(const std::string& node, const Gid& gid) { of(node).writers.push_back(gid); }
  [[nodiscard]] std::vector<OwnNode> nodes() const;

 private:
  OwnNode& of(const std::string& node) {
    const auto renamed = renamed_.find(node);
    const std::string& name = renamed == renamed_.end() ? node : renamed->second;
    return nodes_.try_emplace(name, OwnNode{name, {}, {}}).first->second;
  }
  std::map<std::string, std::string> renamed_;
  std::map<std::string, OwnNode> nodes_;
};

class BridgedTopics {
 public:
  BridgedTopics(Bus& bus, Edge& edge, Participant& participant, NetworkStatus& status,
                RejectionLog& rejections, UnbridgedLog& unbridged)
      : bus_(bus),
        edge_(edge),
        participant_(participant),
        status_(status),
        rejections_(rejections),
        unbridged_(unbridged) {}

  // Makes missing endpoints and, after kGracePeriod, ends those without a node. True: it has to
  // be called again.
  bool follow(const std::vector<TopicInfo>& topics, SteadyTime now);
  // Subscribes on the bus to topics with readers on the network. True: some subscriptions are
  // not effective yet.
  bool match();
  // To the network. Its reference is valid while the call lasts.
  void pass(const Edge::Incoming& message);
  // From the network to the bus, a limited number; true: there may be more.
  bool take();
  // The loop does not keep up: no samples are taken until it has run the pending ones.
  [[nodiscard]] bool is_held_back() const { return backlog_.is_full(); }

  void announce(Announcement& announcement) const;
  [[nodiscard]] std::map<std::string, Matches, std::less<>> matches() const;
  [[nodiscard]] std::uint64_t lost() const;

 private:
  template <class End>
  struct Endpoint {
    std::string node;
    Qos qos;
    std::unique_ptr<End> end;
    bool seen = true;
    SteadyTime gone_since{};  // while not seen
  };
  struct Topic {
    std::string name, type;
    bool latched = false, subscribed = false;
    std::vector<Endpoint<Writer>> writers;
    Writer* carrier = nullptr;  // the one of them that carries the messages of all
    std::vector<Endpoint<Reader>> readers;
    std::shared_ptr<std::atomic<bool>> listening = std::make_shared<std::atomic<bool>>(false);
  };

  template <class End, class Make>
  bool follow_ends(const Topic& topic, std::vector<Endpoint<End>>& ends,
                   const std::vector<doppel::EndpointInfo>& wanted, const Make& make);
  template <class End>
  bool end_ends(std::vector<Endpoint<End>>& ends, SteadyTime now);
  void choose_carrier(TopicId id, Topic& topic);
  void follow_ids(const std::vector<TopicInfo>& infos);
  [[nodiscard]] EndpointSpec spec(const Topic& topic, const Qos& qos) const;
  void subscribe(TopicId id, Topic& topic);
  void unsubscribe(TopicId id, Topic& topic);
  bool take_from(Topic& topic, std::size_t which);

  Bus& bus_;
  Edge& edge_;
  Participant& participant_;
  NetworkStatus& status_;
  RejectionLog& rejections_;
  UnbridgedLog& unbridged_;
  std::map<TopicId, Topic> topics_;
  std::uint64_t lost_by_gone_ = 0;
  Sample sample_;
  Backlog backlog_;
};

}  // namespace doppel::ros2
