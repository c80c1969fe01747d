#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/file_descriptor.h"
#include "doppel/review/doctor/detail/probes.h"
#include "doppel/ros/network/environment.h"
#include "doppel/ros/network/middleware.h"
#include "doppel/ros/network/participant.h"
#include "doppel/ros/server/announcement.h"

namespace doppel::doctor {
namespace {

std::vector<InterfaceFacts> find_interfaces() {
  std::vector<InterfaceFacts> out;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return out;
  for (const ifaddrs* at = all; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr || at->ifa_addr->sa_family != AF_INET) continue;
    char text[INET_ADDRSTRLEN] = "";
    const auto* address = reinterpret_cast<const sockaddr_in*>(at->ifa_addr);
    inet_ntop(AF_INET, &address->sin_addr, text, sizeof text);
    out.push_back({at->ifa_name,
                   text,
                   (at->ifa_flags & IFF_LOOPBACK) != 0,
                   (at->ifa_flags & IFF_UP) != 0,
                   (at->ifa_flags & IFF_MULTICAST) != 0,
                   {}});
  }
  freeifaddrs(all);
  return out;
}

bool is_taken(int type, std::uint32_t address, int port) {
  const FileDescriptor socket(::socket(AF_INET, type | SOCK_CLOEXEC, 0));
  if (!socket.is_open()) return false;
  const int on = 1;
  // Binds as the server does: a port whose last connections are only being wound up is free.
  if (type == SOCK_STREAM) setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in where{};
  where.sin_family = AF_INET;
  where.sin_port = htons(static_cast<std::uint16_t>(port));
  where.sin_addr.s_addr = htonl(address);
  return bind(socket.get(), reinterpret_cast<const sockaddr*>(&where), sizeof where) != 0 &&
         errno == EADDRINUSE;
}

std::vector<NetworkFacts::TakenPort> find_taken_page_ports() {
  std::vector<NetworkFacts::TakenPort> out;
  const std::vector<RunningTwin> twins = find_running();
  for (int port = kFirstPagePort; port <= kLastPagePort; ++port) {
    if (!is_taken(SOCK_STREAM, INADDR_LOOPBACK, port)) continue;
    std::string holder = "another program";
    for (const RunningTwin& twin : twins) {
      if (twin.port == port) holder = fmt::format("the twin of {} (process {})", twin.robot, twin.pid);
    }
    out.push_back({port, holder});
  }
  return out;
}

int count_participants(unsigned domain) {
  int count = 0;
  for (int i = 0; i < kMaxDomainParticipants; ++i) {
    const int port = static_cast<int>(7400 + 250 * domain) + 10 + 2 * i;
    if (port > 65535) break;
    if (is_taken(SOCK_DGRAM, INADDR_ANY, port)) ++count;
  }
  return count;
}

void read_environment(NetworkFacts& facts, std::optional<ros2::ParticipantOptions>& options) {
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    const std::size_t equals = text.find('=');
    if (equals == std::string_view::npos || !(text.starts_with("ROS_") || text.starts_with("RMW_"))) continue;
    facts.environment[std::string(text.substr(0, equals))] = text.substr(equals + 1);
  }
  Diagnostics diagnostics;
  try {
    options = ros2::from_environment([](const char* name) -> const char* { return std::getenv(name); },
                                     diagnostics);
    facts.domain = options->domain;
    facts.range = ros2::to_string(options->range);
  } catch (const InputError& error) {
    facts.environment_failure = error.diagnostics().front().message;
  }
  for (const Diagnostic& remark : diagnostics.all()) facts.remarks.push_back(remark.message);
}

}  // namespace

NetworkFacts probe_network() {
  NetworkFacts facts;
  std::optional<ros2::ParticipantOptions> options;
  read_environment(facts, options);
  facts.interfaces = find_interfaces();
  for (InterfaceFacts& interface : facts.interfaces) {
    if (interface.is_up && (interface.is_loopback || interface.has_multicast_flag))
      interface.multicast_failure = probe_multicast(interface.address, facts.domain);
  }
  facts.taken_participants = count_participants(facts.domain);
  facts.taken_page_ports = find_taken_page_ports();
  if (!options || options->range == ros2::DiscoveryRange::off) return facts;
  try {
    facts.fast_dds = ros2::fast_dds_version();
    (void)ros2::make_participant(*options, [] {});
  } catch (const std::exception& error) {
    facts.participant_failure = error.what();
  }
  return facts;
}

}  // namespace doppel::doctor
