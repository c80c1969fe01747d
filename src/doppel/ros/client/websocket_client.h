#pragma once
// Access to a twin in another process over its server's protocol.

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "doppel/export.h"
#include "doppel/ros/client/buffered_client.h"

namespace doppel {

struct ClientOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 8700;
  std::string token;                                  // if the twin requires one
  std::chrono::milliseconds timeout{5000};            // for responses without a limit of their own
  std::function<bool()> interrupted;                  // called about every 20 ms; may be empty
  std::function<void(const std::string&)> on_status;  // for warnings that belong to no request
};

class DOPPEL_API WebSocketClient : public BufferedClient {
 public:
  // Returns when all existing topics, services and nodes are known. Throws ClientError.
  explicit WebSocketClient(ClientOptions options);
  ~WebSocketClient() override;
  WebSocketClient(const WebSocketClient&) = delete;
  WebSocketClient& operator=(const WebSocketClient&) = delete;

  [[nodiscard]] const std::string& server_name() const;

  [[nodiscard]] std::vector<std::string> nodes() override;
  [[nodiscard]] const TypeSupport& message_type(const std::string& topic) override;
  void subscribe(const std::string& topic) override;
  void unsubscribe(const std::string& topic) override;
  [[nodiscard]] bool wait_until(const std::function<bool()>& condition,
                                std::chrono::steady_clock::time_point until) override;
  void publish(const std::string& topic, const std::string& type, std::span<const std::byte> cdr) override;
  void sync() override;
  std::uint32_t begin_call(const std::string& service, std::span<const std::byte> request) override;
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

}  // namespace doppel
