#pragma once
// Any ROS 2 graph, as the command line's verbs see it: a hidden node ("/_doppel_<pid>") of a participant of
// its own. Endpoints are made when they are requested, with a QoS that meets what is there, as ros2cli does.

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/client/buffered_client.h"
#include "doppel/export.h"
#include "doppel/ros2/environment.h"
#include "doppel/ros2/participant.h"

namespace doppel::ros2 {

struct GraphClientOptions {
  ParticipantOptions network;
  // How long to look who is there; nothing: until no news have come for a short while, 2 s at most, or 5 s
  // where somebody has not said yet what nodes it has.
  std::optional<std::chrono::milliseconds> spin_time;
  std::chrono::milliseconds timeout{5000};                    // for what should come at once
  std::function<bool()> interrupted;                          // asked every 20 ms or so; may be empty
  std::function<void(const std::string& warning)> on_status;  // may be empty
};

class DOPPEL_API GraphClient : public BufferedClient {
 public:
  using MakeParticipant = std::function<std::unique_ptr<Participant>(const ParticipantOptions& options,
                                                                     std::function<void()> on_activity)>;

  // Returns when it knows who is there. Throws ClientError where there is no usable network.
  explicit GraphClient(GraphClientOptions options, const MakeParticipant& make = make_participant);
  // What was published last has a moment to reach its readers.
  ~GraphClient() override;
  GraphClient(const GraphClient&) = delete;
  GraphClient& operator=(const GraphClient&) = delete;

  [[nodiscard]] std::vector<std::string> nodes() override;
  // A type that is not compiled in, or compiled in differently (its hash differs), is asked of the nodes that
  // use it (~/get_type_description).
  [[nodiscard]] const TypeSupport& message_type(const std::string& topic) override;

  void subscribe(const std::string& topic) override;
  void unsubscribe(const std::string& topic) override;
  [[nodiscard]] bool wait_until(const std::function<bool()>& condition,
                                std::chrono::steady_clock::time_point until) override;

  // The first message of a topic waits until all subscriptions that are known are matched. DDS tells no
  // refusals: sync() does nothing.
  void publish(const std::string& topic, const std::string& type, std::span<const std::byte> cdr) override;
  void sync() override {}

  // Waits for a server within reach. One that goes before it has answered makes a refusal.
  std::uint32_t begin_call(const std::string& service, std::span<const std::byte> request) override;

  // Nodes without parameter services are left out, those that do not answer are reported.
  std::vector<NamedParameter> parameters() override;
  std::vector<NamedParameter> parameters(const std::string& node) override;
  Status set_parameter(const std::string& node, const std::string& name,
                       const ParameterValue& value) override;

 private:
  [[nodiscard]] ReceiveBuffer& buffer() const override;

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel::ros2
