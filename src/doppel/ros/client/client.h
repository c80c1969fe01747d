#pragma once
// Synchronous access to a graph of nodes in another process, for the verbs of the command line. Implemented
// by ros/client/websocket_client.h (a twin, over its server's protocol) and ros/network/graph_client.h (any ROS 2 graph,
// by DDS). For one thread. Every function may throw ClientError (connection closed, no response in time,
// refused) and Interrupted.

#include <chrono>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/time.h"
#include "doppel/export.h"
#include "doppel/ros/bus/parameters.h"
#include "doppel/ros/messages/codec.h"

namespace doppel {

struct DOPPEL_API ClientError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
// The interrupt callback returned true during a wait (Ctrl-C).
struct Interrupted {};

class DOPPEL_API Client {
 public:
  // One node's endpoint of a topic. Empty fields: the protocol does not provide them.
  struct Endpoint {
    std::string node, type, type_hash, gid;
    // The qualities as `ros2 topic info -v` lists them: {"Reliability", "RELIABLE"}, ...
    std::vector<std::pair<std::string, std::string>> qos;
  };
  struct Topic {
    std::string type, schema;  // "": not known yet
    std::vector<std::string> publishers, subscribers;
    std::vector<Endpoint> publisher_ends, subscriber_ends;
  };
  struct Service {
    std::string type;
    std::vector<std::string> providers, clients;  // clients: empty if the protocol does not provide them
    // The ends of requests, then those of replies; empty if the protocol does not provide them.
    std::vector<Endpoint> server_ends, client_ends;
  };
  struct Received {
    std::string topic, type;
    Time stamp{};
    Bytes cdr;
  };
  struct Answer {
    bool ok = false;
    std::string why;
    Bytes response;
  };

  virtual ~Client() = default;

  // The topics as last received; updated during waits.
  [[nodiscard]] virtual const std::map<std::string, Topic>& topics() const = 0;
  [[nodiscard]] virtual const std::map<std::string, Service>& services() const = 0;
  // Full names, sorted; a name of several nodes is repeated.
  [[nodiscard]] virtual std::vector<std::string> nodes() = 0;
  // The type of the topic's messages; throws ClientError if it cannot be determined, or there is
  // no such topic.
  [[nodiscard]] virtual const TypeSupport& message_type(const std::string& topic) = 0;

  // Throws ClientError if there is no such topic.
  virtual void subscribe(const std::string& topic) = 0;
  virtual void unsubscribe(const std::string& topic) = 0;
  // True: `message` is the next received one; false: the time is over.
  virtual bool next(Received& message, std::chrono::steady_clock::time_point until) = 0;
  [[nodiscard]] virtual bool wait_until(const std::function<bool()>& condition,
                                        std::chrono::steady_clock::time_point until) = 0;

  // Sent when it returns, but possibly not processed. sync() returns when all messages have been processed,
  // and throws ClientError if one was refused.
  virtual void publish(const std::string& topic, const std::string& type, std::span<const std::byte> cdr) = 0;
  virtual void sync() = 0;

  // Sends a service request and returns its number; take_answer() gets the response or refusal later.
  virtual std::uint32_t begin_call(const std::string& service, std::span<const std::byte> request) = 0;
  virtual bool take_answer(std::uint32_t call, Answer& answer) = 0;
  // Sends a request and waits for the response. Negative `at_most`: no limit.
  Answer call(const std::string& service, std::span<const std::byte> request,
              std::chrono::milliseconds at_most = std::chrono::seconds(10));

  virtual std::vector<NamedParameter> parameters() = 0;  // of all nodes
  virtual std::vector<NamedParameter> parameters(const std::string& node) = 0;
  virtual Status set_parameter(const std::string& node, const std::string& name,
                               const ParameterValue& value) = 0;

  // Throws ClientError with the nearest name if there is none.
  const Topic& find_topic(const std::string& name) const;
  const Service& find_service(const std::string& name) const;

 protected:
  Client() = default;
  Client(const Client&) = default;
  Client& operator=(const Client&) = default;
};

}  // namespace doppel
