#pragma once
// A WebSocket client that may misbehave, for tests.

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace doppel::test {

class RawClient {
 public:
  using Socket = boost::asio::ip::tcp::socket;
  using Header = std::pair<std::string, std::string>;

  explicit RawClient(std::uint16_t port) {
    socket_.next_layer().connect({boost::asio::ip::address_v4::loopback(), port});
  }
  // "" or the reason why the handshake failed.
  std::string handshake(std::string host = "localhost", std::vector<Header> headers = {},
                        const std::string& target = "/") {
    bool has_protocol = false;
    for (const auto& [name, value] : headers) has_protocol |= name == "Sec-WebSocket-Protocol";
    if (!has_protocol) headers.emplace_back("Sec-WebSocket-Protocol", "foxglove.websocket.v1");
    socket_.set_option(boost::beast::websocket::stream_base::decorator([headers](auto& request) {
      for (const auto& [name, value] : headers) request.set(name, value);
    }));
    boost::system::error_code failed;
    // Not the synchronous form, which gives no details of a rejection.
    socket_.async_handshake(response_, host, target,
                            [&failed](boost::system::error_code outcome) { failed = outcome; });
    io_.run();
    socket_.read_message_max(std::size_t{64} << 20);
    return failed ? std::to_string(response_.result_int()) + " " + response_.body() : "";
  }
  [[nodiscard]] std::string header(const std::string& name) const { return std::string(response_[name]); }

  void send(const std::string& text) {
    socket_.text(true);
    socket_.write(boost::asio::buffer(text));
  }
  void send_binary(const std::string& bytes) {
    socket_.binary(true);
    socket_.write(boost::asio::buffer(bytes));
  }
  // The next frame; throws when the connection ends.
  std::string receive() {
    boost::beast::flat_buffer buffer;
    socket_.read(buffer);
    return boost::beast::buffers_to_string(buffer.data());
  }
  nlohmann::json receive_op(const std::string& op) {
    while (true) {
      const auto frame = nlohmann::json::parse(receive(), nullptr, false);
      if (frame.is_object() && frame["op"] == op) return frame;
    }
  }
  // Reads until the server closes; its reason.
  std::string closing_reason() {
    try {
      while (true) receive();
    } catch (const boost::system::system_error&) {
      return socket_.reason().reason.c_str();
    }
  }
  Socket& tcp() { return socket_.next_layer(); }

 private:
  boost::asio::io_context io_;
  boost::beast::websocket::stream<Socket> socket_{io_};
  boost::beast::websocket::response_type response_;
};

}  // namespace doppel::test
