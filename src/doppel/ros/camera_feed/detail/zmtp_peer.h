#pragma once
// One subscriber of a publisher by ZeroMQ's protocol ZMTP 3.0 (rfc.zeromq.org/spec/23): bytes in, bytes
// out, without a socket. The mechanism is NULL: ZeroMQ's peers have no authentication.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace doppel {

class ZmtpPeer {
 public:
  ZmtpPeer();

  // Bytes of the peer. False: it does not speak the protocol, or is no subscriber, and is to be closed.
  [[nodiscard]] bool receive(std::string_view bytes);
  // True: it has subscribed to messages that begin like this one.
  [[nodiscard]] bool subscribes(std::string_view message) const;
  // Queues a message of one frame.
  void send(std::string_view message);

  // Bytes that wait for the peer, and how many of them were written.
  [[nodiscard]] std::string_view waiting() const { return std::string_view(out_).substr(written_); }
  void take(std::size_t bytes);
  // False: so much waits that more would only delay what is newer.
  [[nodiscard]] bool has_room() const { return waiting().size() <= kMaxWaiting; }
  [[nodiscard]] std::size_t memory() const { return out_.capacity() + received_.capacity(); }

  static constexpr std::size_t kMaxWaiting = std::size_t{4} << 20;  // bytes

 private:
  struct Frame {
    std::uint8_t flags = 0;
    std::string_view body;
  };
  [[nodiscard]] bool read_greeting();
  [[nodiscard]] bool read_frames();
  [[nodiscard]] bool read(const Frame& frame);
  [[nodiscard]] bool read_command(std::string_view body);
  void add_subscription(bool on, std::string_view prefix);
  void add_frame(std::uint8_t flags, std::string_view body);

  std::string received_, out_;
  std::size_t written_ = 0;
  bool greeted_ = false, ready_ = false;
  std::vector<std::string> prefixes_;  // of its subscriptions; one can be in it several times
};

}  // namespace doppel
