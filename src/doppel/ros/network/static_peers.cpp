#include "doppel/ros/network/detail/static_peers.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>

#include "doppel/base/core/guarded_thread.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2 {
namespace {

constexpr std::chrono::milliseconds kCancelCheck{20};

bool is_address(const std::string& name) {
  in_addr address{};
  return inet_pton(AF_INET, name.c_str(), &address) == 1;
}

// Shared with the thread of the lookup, which may outlive the call.
struct Search {
  std::vector<std::string> addresses;  // in the order of the names, when it is done
  std::mutex mutex;
  std::condition_variable ended;
  bool is_done = false;
  std::string failure;  // text of an exception of the lookup; "": none

  void run(const std::vector<std::string>& names, const Lookup& lookup) {
    for (const std::string& name : names) addresses.push_back(is_address(name) ? name : lookup(name));
    end("");
  }
  void end(const std::string& with_failure) {
    const std::lock_guard lock(mutex);
    failure = with_failure;
    is_done = true;
    ended.notify_all();
  }
};

}  // namespace

std::string look_up(const std::string& name) {
  addrinfo wanted{};
  wanted.ai_family = AF_INET;
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(name.c_str(), nullptr, &wanted, &found) != 0) return "";
  std::array<char, INET_ADDRSTRLEN> text{};
  const auto* const address = reinterpret_cast<const sockaddr_in*>(found->ai_addr);
  inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size());
  freeaddrinfo(found);
  return text.data();
}

std::vector<std::string> addresses_of(const std::vector<std::string>& peers,
                                      const std::function<bool()>& is_cancelled, Lookup lookup) {
  if (std::ranges::all_of(peers, is_address)) return peers;
  const auto search = std::make_shared<Search>();
  guarded_thread([search, peers, lookup = std::move(lookup)] { search->run(peers, lookup); },
                 [search](const std::string& what) { search->end(what); })
      .detach();
  std::unique_lock lock(search->mutex);
  while (!search->ended.wait_for(lock, kCancelCheck, [&] { return search->is_done; }))
    if (is_cancelled && is_cancelled())
      throw NetworkError("the lookup of the hosts in ROS_STATIC_PEERS timed out");
  if (!search->failure.empty())
    throw NetworkError("cannot look up the hosts in ROS_STATIC_PEERS: " + search->failure);
  for (std::size_t i = 0; i < peers.size(); ++i) {
    if (search->addresses[i].empty())
      throw NetworkError("ROS_STATIC_PEERS contains '" + peers[i] +
                         "', which is neither an IP address nor a known host; fix or remove it");
  }
  return search->addresses;
}

}  // namespace doppel::ros2
