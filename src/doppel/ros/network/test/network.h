#pragma once
// For tests that communicate with themselves over loopback: a separate domain, and waiting for conditions.

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <thread>

#include "doppel/ros/network/environment.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2::test {

constexpr std::chrono::seconds kTimeout{20};

// A domain that no other test program on this machine uses at the moment: the socket of that name is the
// lock.
class OwnDomain {
 public:
  OwnDomain() {
    while (!try_all()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  ~OwnDomain() { ::close(socket_); }
  OwnDomain(const OwnDomain&) = delete;
  OwnDomain& operator=(const OwnDomain&) = delete;
  [[nodiscard]] std::uint32_t id() const { return id_; }

 private:
  bool try_all() {
    for (id_ = 10; id_ < 20; ++id_) {
      socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
      const std::string name = "doppel-test-domain-" + std::to_string(id_);
      sockaddr_un where{};
      where.sun_family = AF_UNIX;
      std::memcpy(where.sun_path + 1, name.data(), name.size());  // a first NUL: not in the file system
      if (::bind(socket_, reinterpret_cast<const sockaddr*>(&where), sizeof where) == 0) return true;
      ::close(socket_);
    }
    return false;
  }
  std::uint32_t id_ = 0;
  int socket_ = -1;
};

// Wakes the threads that wait for a condition.
class Activity {
 public:
  std::function<void()> signal() {
    return [this] {
      const std::lock_guard lock(mutex_);
      changed_.notify_all();
    };
  }
  template <class Condition>
  bool wait(Condition condition, std::chrono::milliseconds timeout = kTimeout) {
    const auto end = std::chrono::steady_clock::now() + timeout;
    std::unique_lock lock(mutex_);
    while (std::chrono::steady_clock::now() < end) {
      lock.unlock();
      if (condition()) return true;
      lock.lock();
      changed_.wait_for(lock, std::chrono::milliseconds(10));
    }
    return false;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
};

inline ParticipantOptions on_domain(const OwnDomain& domain) {
  ParticipantOptions options;
  options.domain = domain.id();
  return options;
}

// A CDR string with RTPS's padding.
inline Bytes cdr_text(std::string_view text) {
  Bytes bytes{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  const auto size = static_cast<std::uint32_t>(text.size() + 1);
  for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<std::byte>(size >> (8 * i)));
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
  do {
    bytes.push_back(std::byte{0});
  } while (bytes.size() % 4 != 0);
  return bytes;
}

inline EndpointSpec text_topic(const QosProfile& qos = {}, const std::string& topic = "rt/text") {
  return {topic, "std_msgs::msg::dds_::String_", "RIHS01_" + std::string(64, 'a'), qos};
}

}  // namespace doppel::ros2::test
