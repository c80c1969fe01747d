#pragma once
// Access of the command line's verbs to any ROS 2 graph: a hidden node ("/_doppel_<pid>") with its own
// participant. Endpoints are made on request, with a QoS compatible with the existing ones, as in ros2cli.

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/client/buffered_client.h"
#include "doppel/ros/network/environment.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2 {

struct GraphClientOptions {
  ParticipantOptions network;
  // Duration of the initial discovery; nullopt: until nothing new is discovered for a short time, at most 2
  // s, or 5 s if a participant has not announced its nodes yet.
  std::optional<std::chrono::milliseconds> spin_time;
  std::chrono::milliseconds timeout{5000};                    // for responses without a limit of their own
  std::function<bool()> interrupted;                          // called about every 20 ms; may be empty
  std::function<void(const std::string& warning)> on_status;  // may be empty
};

class DOPPEL_API GraphClient : public BufferedClient {
 public:
  using MakeParticipant = std::function<std::unique_ptr<Participant>(const ParticipantOptions& options,
                                                                     std::function<void()> on_activity)>;

  // Returns after the initial discovery. Throws ClientError without a usable network.
  explicit GraphClient(GraphClientOptions options, const MakeParticipant& make = make_participant);
  // Waits a short time for the last published messages to reach their readers.
  ~GraphClient() override;
  GraphClient(const GraphClient&) = delete;
  GraphClient& operator=(const GraphClient&) = delete;

  [[nodiscard]] std::vector<std::string> nodes() override;
  // A type that is not compiled in, or whose compiled version has another hash, is requested from the nodes
  // that use it (~/get_type_description).
  [[nodiscard]] const TypeSupport& message_type(const std::string& topic) override;

  void subscribe(const std::string& topic) override;
  void unsubscribe(const std::string& topic) override;
  [[nodiscard]] bool wait_until(const std::function<bool()>& condition,
                                std::chrono::steady_clock::time_point until) override;

  // The first message of a topic waits until all known subscriptions are matched. sync() does nothing,
  // because DDS reports no refusals.
  void publish(const std::string& topic, const std::string& type, std::span<const std::byte> cdr) override;
  void sync() override {}

  // Waits for a reachable server. If it disappears before its response, the call is refused.
  std::uint32_t begin_call(const std::string& service, std::span<const std::byte> request) override;

  // Nodes without parameter services are left out; those that do not respond are reported.
  std::vector<NamedParameter> parameters() override;
  std::vector<NamedParameter> parameters(const std::string& node) override;
  Status set_parameter(const std::string& node, const std::string& name,
                       const ParameterValue& value) override;

 private:
  [[nodiscard]] ReceiveBuffer& buffer() const override;
  void warn(const std::string& text) const override;

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel::ros2
