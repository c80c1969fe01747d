#pragma once
// A listening TCP socket whose connections are ZeroMQ's subscribers. One thread, which waits for all of them.

#include <list>
#include <string>
#include <string_view>

#include "doppel/ros/camera_feed/camera_feed.h"
#include "doppel/ros/camera_feed/detail/zmtp_peer.h"

namespace doppel {

class PublishingSocket {
 public:
  // Throws InputError: the address is none of this machine, the port is in use.
  explicit PublishingSocket(const CameraFeedOptions& options);
  ~PublishingSocket();
  PublishingSocket(const PublishingSocket&) = delete;
  PublishingSocket& operator=(const PublishingSocket&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }
  // Serves the connections until one of them, or `other`, has bytes, or the time is over.
  void wait(int other, int milliseconds);
  [[nodiscard]] bool has_subscriber() const;
  // To each subscriber that has taken most of what it got before; the others miss it, as with every PUB.
  void publish(std::string_view message);

 private:
  struct Connection {
    int fd = -1;
    ZmtpPeer peer = {};
    bool ended = false;
  };
  void accept_all();
  static void read(Connection& one);
  static void write(Connection& one);
  void close_ended();

  int listener_ = -1;
  std::string address_;
  std::list<Connection> connections_;
};

}  // namespace doppel
