#include "doppel/ros/server/detail/listening.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <array>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/server/announcement.h"

namespace doppel::net {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr int kPortsToTry = 20;

asio::ip::address find_address(asio::io_context& io, const std::string& host) {
  error_code failed;
  const auto address = asio::ip::make_address(host, failed);
  if (!failed) return address;
  const auto found = tcp::resolver(io).resolve(host, "", failed);
  if (failed || found.empty()) {
    throw InputError("server.host", {}, fmt::format("'{}' is not an address of this machine", host),
                     "use 127.0.0.1, 0.0.0.0 (all addresses of this machine) or one shown by 'ip addr'");
  }
  for (const auto& entry : found) {
    if (entry.endpoint().address().is_v4()) return entry.endpoint().address();
  }
  return found.begin()->endpoint().address();
}

[[noreturn]] void refuse_taken(const ServerOptions& options, int tries) {
  const std::string ports = tries == 1
                                ? fmt::format("port {} is", options.port)
                                : fmt::format("ports {} to {} are", options.port, options.port + tries - 1);
  throw InputError("server.port_taken", {}, fmt::format("{} in use by {}", ports, port_holder(options.port)),
                   "stop that program, or choose another port with --port N");
}

}  // namespace

std::string port_holder(std::uint16_t port) {
  for (const RunningTwin& twin : find_running()) {
    if (twin.port == port) return fmt::format("the twin of {} (process {})", twin.robot, twin.pid);
  }
  return fmt::format("another program ('ss -ltnp sport = :{}' shows which)", port);
}

tcp::acceptor listen(asio::io_context& io, const ServerOptions& options) {
  const auto address = find_address(io, options.host);
  const int tries = options.any_free_port && options.port != 0 ? kPortsToTry + 1 : 1;
  error_code failed;
  for (int i = 0; i < tries && options.port + i <= 0xFFFF; ++i) {
    const tcp::endpoint endpoint(address, static_cast<std::uint16_t>(options.port + i));
    tcp::acceptor acceptor(io);
    acceptor.open(endpoint.protocol(), failed);
    if (!failed) acceptor.set_option(tcp::acceptor::reuse_address(true), failed);
    if (!failed) acceptor.bind(endpoint, failed);
    if (!failed) acceptor.listen(asio::socket_base::max_listen_connections, failed);
    if (!failed) return acceptor;
    if (failed != asio::error::address_in_use) break;
  }
  if (failed == asio::error::address_in_use) refuse_taken(options, tries);
  throw InputError(
      "server.listen", {},
      fmt::format("cannot listen on {} port {}: {}", options.host, options.port, failed.message()),
      "'ip addr' shows this machine's addresses; ports below 1024 need privileges");
}

std::string reachable_host(const asio::ip::address& address) {
  const auto as_host = [](const asio::ip::address& a) {
    return a.is_v6() ? "[" + a.to_string() + "]" : a.to_string();
  };
  if (!address.is_unspecified()) return as_host(address);
  std::string host = own_address(address);
  ifaddrs* interfaces = nullptr;
  if (getifaddrs(&interfaces) != 0) return host;
  for (const ifaddrs* at = interfaces; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr || at->ifa_addr->sa_family != AF_INET) continue;
    if ((at->ifa_flags & IFF_LOOPBACK) != 0 || (at->ifa_flags & IFF_UP) == 0) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* found = reinterpret_cast<const sockaddr_in*>(at->ifa_addr);
    if (inet_ntop(AF_INET, &found->sin_addr, text.data(), text.size()) == nullptr) continue;
    host = text.data();
    break;
  }
  freeifaddrs(interfaces);
  return host;
}

std::string own_address(const asio::ip::address& address) {
  if (!address.is_unspecified()) return address.to_string();
  return address.is_v6() ? "::1" : "127.0.0.1";
}

}  // namespace doppel::net
