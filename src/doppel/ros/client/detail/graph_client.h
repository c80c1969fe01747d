#pragma once
// The implementation of GraphClient, shared by graph_client.cpp,
// graph_client_topics.cpp and graph_client_calls.cpp.

#include <set>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/ros/client/graph_client.h"
#include "doppel/ros/network/graph.h"
#include "doppel/ros/network/service.h"

namespace doppel::ros2 {

struct GraphClient::Impl : ReceiveBuffer {
  using Clock = std::chrono::steady_clock;

  Impl(GraphClientOptions chosen, const MakeParticipant& make);
  ~Impl();

  // -- graph_client.cpp
  void discover();
  [[nodiscard]] bool is_complete() const;  // every participant of ROS 2 has nodes, every endpoint its node
  [[nodiscard]] bool is_alone() const;
  bool wait(const std::function<bool()>& condition, Clock::time_point until);
  void turn();  // handles everything received
  void rebuild();
  void announce();
  [[nodiscard]] bool is_own(const Gid& gid) const;
  void warn(const std::string& text) const;

  // -- graph_client_topics.cpp
  [[nodiscard]] GraphTopic topic_of_others(const std::string& name) const;
  [[nodiscard]] QosProfile fitting(const GraphTopic& topic) const;
  Writer& writer(const std::string& topic, const std::string& type);
  void warn_of_incompatible_publishers();
  std::shared_ptr<const TypeSupport> ask_for_type(const std::string& node, const std::string& type,
                                                  const std::string& hash, std::string& why);

  // -- graph_client_calls.cpp
  ServiceClient& service_client(const std::string& name);
  void take_replies();
  std::uint32_t begin_call(const std::string& service, std::span<const std::byte> request);
  Answer ask(const std::string& service, const Bytes& request);  // and waits, within the patience

  struct Subscription {
    std::string type;
    QosProfile qos;
    std::unique_ptr<Reader> reader;
  };
  struct Pending {
    std::string service;
    std::int64_t sequence = 0;
  };

  GraphClientOptions options;
  std::string node_name;
  FileDescriptor wake;  // outlives the participant, whose threads write to it
  std::unique_ptr<Participant> participant;
  std::unique_ptr<Graph> graph;
  Clock::time_point changed_at = Clock::now();

  std::map<std::string, Subscription> subscriptions;
  std::map<std::pair<std::string, std::string>, std::unique_ptr<Writer>> writers;  // topic, type
  std::map<std::string, std::unique_ptr<ServiceClient>> clients;
  std::set<Gid> warned_of;
  std::map<std::uint32_t, Pending> pending;
  std::map<std::string, std::shared_ptr<const TypeSupport>> described;  // by topic
  std::optional<Clock::time_point> last_published;
};

}  // namespace doppel::ros2
