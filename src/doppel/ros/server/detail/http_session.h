#pragma once
// One HTTP connection: a bounded number of requests, each within a bounded time, until it ends or becomes
// a client's WebSocket.

#include <array>
#include <chrono>
#include <memory>
#include <optional>

#include "doppel/ros/server/detail/connection.h"
#include "doppel/ros/server/detail/http_responses.h"

namespace doppel::net {

class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(tcp::socket socket, Context& context);
  ~HttpSession();
  HttpSession(const HttpSession&) = delete;
  HttpSession& operator=(const HttpSession&) = delete;

  void read();  // the next request
  // The time since which a whole request is awaited; time_point::max(): a response is being sent.
  [[nodiscard]] std::chrono::steady_clock::time_point waiting_since() const { return waiting_since_; }
  void close();

 private:
  void unreadable(error_code why);
  void answer(const Request& request);
  void upgrade(const Request& request);
  void reply(HttpResponse answer);
  void send_part();
  void end_response();
  void linger();

  Context& context_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  HttpResponse answer_;  // kept while it is being sent
  http::response<http::span_body<const char>> response_;
  std::array<char, 1024> discarded_{};
  std::size_t requests_ = 0, lingered_ = 0;
  std::chrono::steady_clock::time_point waiting_since_{};
};

}  // namespace doppel::net
