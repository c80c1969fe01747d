#include "doppel/ros/camera_feed/detail/publishing_socket.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxConnections = 32;
constexpr int kMaxReads = 16;  // of one subscriber in a turn: one that never ends leaves the others theirs

[[noreturn]] void refuse(const CameraFeedOptions& options, int listener) {
  const int why = errno;
  if (listener >= 0) ::close(listener);
  throw InputError(
      "cameras.port", {},
      fmt::format("the cameras cannot be published at {}:{}: {}", options.host, options.port,
                  std::strerror(why)),
      "choose another one with --zmq-cameras PORT, or HOST:PORT with an address of this machine");
}

}  // namespace

PublishingSocket::PublishingSocket(const CameraFeedOptions& options) {
  sockaddr_in where{};
  where.sin_family = AF_INET;
  where.sin_port = htons(options.port);
  if (inet_pton(AF_INET, options.host.c_str(), &where.sin_addr) != 1) {
    errno = EADDRNOTAVAIL;
    refuse(options, -1);
  }
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (listener_ < 0) refuse(options, -1);
  const int yes = 1;
  static_cast<void>(::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes));
  auto* const name = reinterpret_cast<sockaddr*>(&where);
  socklen_t size = sizeof where;
  if (::bind(listener_, name, size) != 0 || ::listen(listener_, static_cast<int>(kMaxConnections)) != 0 ||
      ::getsockname(listener_, name, &size) != 0)
    refuse(options, listener_);
  address_ = fmt::format("tcp://{}:{}", options.host, ntohs(where.sin_port));
}

PublishingSocket::~PublishingSocket() {
  for (const Connection& one : connections_) ::close(one.fd);
  ::close(listener_);
}

void PublishingSocket::wait(int other, int milliseconds) {
  std::vector<pollfd> polled{{listener_, POLLIN, 0}, {other, POLLIN, 0}};
  for (const Connection& one : connections_) {
    const int events = one.peer.waiting().empty() ? POLLIN : POLLIN | POLLOUT;
    polled.push_back({one.fd, static_cast<short>(events), 0});
  }
  if (::poll(polled.data(), polled.size(), milliseconds) <= 0) return;
  std::size_t i = 2;
  for (Connection& one : connections_) {
    const short happened = polled[i++].revents;
    if ((happened & ~POLLOUT) != 0) read(one);
    if (!one.ended) write(one);
  }
  close_ended();
  if ((polled[0].revents & POLLIN) != 0) accept_all();
}

void PublishingSocket::accept_all() {
  while (true) {
    const int fd = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return;
    if (connections_.size() >= kMaxConnections) {
      ::close(fd);
      continue;
    }
    const int yes = 1;
    static_cast<void>(::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes));
    connections_.push_back({.fd = fd});
    write(connections_.back());
  }
}

void PublishingSocket::read(Connection& one) {
  std::array<char, 4096> bytes{};
  for (int i = 0; i < kMaxReads && !one.ended; ++i) {
    const ssize_t count = ::recv(one.fd, bytes.data(), bytes.size(), 0);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    one.ended = count <= 0 || !one.peer.receive({bytes.data(), static_cast<std::size_t>(count)});
  }
}

void PublishingSocket::write(Connection& one) {
  while (!one.peer.waiting().empty()) {
    const std::string_view waiting = one.peer.waiting();
    const ssize_t count = ::send(one.fd, waiting.data(), waiting.size(), MSG_NOSIGNAL);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (count < 0) {
      one.ended = true;
      return;
    }
    one.peer.take(static_cast<std::size_t>(count));
  }
}

void PublishingSocket::close_ended() {
  for (const Connection& one : connections_) {
    if (one.ended) ::close(one.fd);
  }
  std::erase_if(connections_, [](const Connection& one) { return one.ended; });
}

bool PublishingSocket::has_subscriber() const {
  return std::ranges::any_of(connections_, [](const Connection& one) { return one.peer.subscribes("{"); });
}

void PublishingSocket::publish(std::string_view message) {
  for (Connection& one : connections_) {
    if (!one.peer.subscribes(message) || !one.peer.has_room()) continue;
    one.peer.send(message);
    write(one);
  }
  close_ended();
}

}  // namespace doppel
