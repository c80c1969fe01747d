#pragma once
// One client's WebSocket: passes received frames to the hub and sends frames of its queue.

#include <chrono>
#include <memory>

#include "doppel/ros/server/detail/connection.h"
#include "doppel/ros/server/detail/rate_limit.h"
#include "doppel/ros/server/send_queue.h"

namespace doppel::net {

class WebSocketSession : public ClientLink, public std::enable_shared_from_this<WebSocketSession> {
 public:
  WebSocketSession(tcp::socket socket, Context& context);
  ~WebSocketSession() override;
  WebSocketSession(const WebSocketSession&) = delete;
  WebSocketSession& operator=(const WebSocketSession&) = delete;

  void accept(const Request& request, std::string_view subprotocol);
  void send(OutgoingFrame frame) override;
  [[nodiscard]] std::size_t unsent_assets() const override { return queue_.assets(); }
  void close(websocket::close_code code, std::string_view reason);
  // Passes on the frame that was received while the hub was not ready for it; false: it still is not.
  [[nodiscard]] bool resume();

 private:
  void read();
  void received();
  [[nodiscard]] bool is_hub_ready() const;
  [[nodiscard]] bool is_reset();
  void hand_over();
  [[nodiscard]] bool within_limits(std::size_t bytes);
  [[nodiscard]] std::size_t max_unsent() const;
  void read_on();
  void write();
  void write_soon();
  void leave();
  void end();
  // An exception of `work` ends the connection before it is rethrown to the server: a handler that throws
  // releases this session, so the hub must not have a reference to it any more.
  template <class Work>
  void or_end(const Work& work);

  Context& context_;
  websocket::stream<beast::tcp_stream> socket_;
  beast::flat_buffer buffer_;
  SendQueue queue_;
  MessageLimit messages_, bytes_;
  OutgoingFrame in_flight_;
  std::chrono::milliseconds bundle_period_{};  // zero: each message has a frame of its own
  asio::steady_timer bundle_timer_;
  Hub::ClientId id_ = 0;
  bool reading_ = false, writing_ = false, closing_ = false, ended_ = false;
  bool gathering_ = false;  // messages wait for the bundle's timer
  bool holding_ = false;    // a received frame, until the hub is ready for it
};

}  // namespace doppel::net
