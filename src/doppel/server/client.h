#pragma once
// A twin seen from another process: what the command line's verbs need, synchronously, over the server's
// protocol. Every function may throw ClientError (the twin has ended, it did not answer in time, it refused)
// and Interrupted.

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "doppel/bus/parameters.h"
#include "doppel/core/time.h"
#include "doppel/messages/codec.h"

namespace doppel {

struct ClientError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
// ClientOptions::interrupted has said so while something was waited for.
struct Interrupted {};

struct ClientOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 8700;
  std::string token;                                  // where the twin asks for one
  std::chrono::milliseconds patience{5000};           // for what should come at once
  std::function<bool()> interrupted;                  // asked every 20 ms or so; may be empty
  std::function<void(const std::string&)> on_status;  // warnings that belong to no request
};

class Client {
 public:
  struct Topic {
    std::string type;  // "": nobody knows yet
    std::vector<std::string> publishers, subscribers;
    std::string schema;
  };
  struct Service {
    std::string type;
    std::vector<std::string> providers;
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

  // Returns when it knows all topics, services and nodes that there are.
  explicit Client(ClientOptions options);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  [[nodiscard]] const std::string& server_name() const;
  // As last heard; kept up to date while something is waited for.
  [[nodiscard]] const std::map<std::string, Topic>& topics() const;
  [[nodiscard]] const std::map<std::string, Service>& services() const;

  // Throws ClientError if there is no such topic.
  void subscribe(const std::string& topic);
  void unsubscribe(const std::string& topic);
  // Whether a message came in time.
  bool next(Received& message, std::chrono::steady_clock::time_point until);
  [[nodiscard]] bool wait_until(const std::function<bool()>& condition,
                                std::chrono::steady_clock::time_point until);

  // Sent when it returns, not yet taken: sync() returns when the twin has taken all, and throws what it
  // refused.
  void publish(const std::string& topic, const std::string& type, std::span<const std::byte> cdr);
  void sync();

  // A service's answer or its refusal. No time limit: negative.
  Answer call(const std::string& service, std::span<const std::byte> request,
              std::chrono::milliseconds at_most = std::chrono::seconds(10));
  // The same in two steps, for what is answered late.
  std::uint32_t begin_call(const std::string& service, std::span<const std::byte> request);
  bool take_answer(std::uint32_t call, Answer& answer);

  std::vector<NamedParameter> parameters();
  Status set_parameter(const std::string& node, const std::string& name, const ParameterValue& value);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
