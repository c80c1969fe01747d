#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "doppel/review/doctor/findings.h"
#include "doppel/ros/network/middleware.h"

namespace doppel::doctor {
namespace {

Finding judge_environment(const NetworkFacts& facts) {
  if (!facts.environment_failure.empty()) {
    return {Level::problem,
            "network",
            "ros.environment",
            facts.environment_failure,
            "`doppel up` refuses to start",
            "correct or unset the variable"};
  }
  std::vector<std::string> set;
  for (const auto& [name, value] : facts.environment) set.push_back(name + "=" + value);
  const std::string variables =
      set.empty() ? "no ROS_ variable is set" : fmt::format("{}", fmt::join(set, " "));
  const std::string meaning =
      facts.range == "off"
          ? std::string("ROS 2's network is off")
          : fmt::format("domain {}, {}", facts.domain,
                        facts.range == "localhost" ? "this machine only" : "range " + facts.range);
  if (facts.remarks.empty())
    return {Level::ok, "network", "ros.environment", fmt::format("{}: {}", variables, meaning), "", ""};
  return {Level::note,
          "network",
          "ros.environment",
          fmt::format("{}: {}", variables, meaning),
          fmt::format("{}", fmt::join(facts.remarks, "; ")),
          "unset what is not meant"};
}

Finding judge_participant(const NetworkFacts& facts) {
  if (facts.participant_failure.empty()) {
    if (facts.range == "off")
      return {Level::ok, "network", "ros.participant", "no participant is made: discovery is off", "", ""};
    return {Level::ok,
            "network",
            "ros.participant",
            fmt::format("a participant can join domain {}; {} of {} on this machine are taken", facts.domain,
                        facts.taken_participants, kMaxDomainParticipants),
            "",
            ""};
  }
  return {Level::note,
          "network",
          "ros.participant",
          facts.participant_failure,
          "twins run, but no ROS 2 program sees them",
          "correct the cause, or use --no-ros"};
}

// Every participant on the network can command the twin: ROS 2 has no authentication without DDS Security.
Finding judge_middleware(const NetworkFacts& facts) {
  const std::string description = ros2::describe_middleware(facts.fast_dds);
  if (facts.range == "localhost")
    return {Level::ok, "network", "ros.middleware", description + "; only this machine reaches it", "", ""};
  return {
      Level::note,
      "network",
      "ros.middleware",
      description,
      "everyone on the local network can command a twin: ROS 2 has no authentication",
      "use a network that you trust, or ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST; `doppel man security.md`"};
}

Finding judge_interface(const InterfaceFacts& interface) {
  const std::string name = "multicast." + interface.name;
  const std::string shown = fmt::format("{} ({})", interface.name, interface.address);
  if (!interface.is_up) {
    return {interface.is_loopback ? Level::problem : Level::note,
            "network",
            name,
            shown + " is down",
            interface.is_loopback ? "neither shells nor the browser reach a twin" : "nobody is met there",
            fmt::format("ip link set {} up", interface.name)};
  }
  if (!interface.is_loopback && !interface.has_multicast_flag) {
    return {Level::note,
            "network",
            name,
            shown + " has no multicast",
            "ROS 2 programs behind it are not discovered",
            "name them in ROS_STATIC_PEERS"};
  }
  if (interface.multicast_failure.empty())
    return {Level::ok, "network", name, shown + " carries ROS 2's discovery (239.255.0.1)", "", ""};
  return {Level::note,
          "network",
          name,
          fmt::format("{}: no multicast: {}", shown, interface.multicast_failure),
          interface.is_loopback ? "ROS 2 programs on this machine may not discover each other"
                                : "ROS 2 programs behind it are not discovered",
          interface.is_loopback
              ? "ip link set lo multicast on; allow UDP 7400 and above in the firewall"
              : "allow UDP 7400 and above in the firewall, or name peers in ROS_STATIC_PEERS"};
}

Finding judge_page_ports(const NetworkFacts& facts) {
  const auto& taken = facts.taken_page_ports;
  if (taken.size() > static_cast<std::size_t>(kLastPagePort - kFirstPagePort)) {
    return {Level::problem,
            "network",
            "ports.page",
            fmt::format("the ports {} to {} are all taken", kFirstPagePort, kLastPagePort),
            "`doppel up` finds no port for its server",
            "end some programs, or choose another with --port N"};
  }
  if (taken.empty() || taken.front().port != kFirstPagePort)
    return {Level::ok, "network", "ports.page", fmt::format("port {} is free", kFirstPagePort), "", ""};
  return {Level::note,
          "network",
          "ports.page",
          fmt::format("port {} is taken by {}", kFirstPagePort, taken.front().holder),
          "a further twin takes the next free port, which its banner shows",
          fmt::format("`ss -ltnp sport = :{}` shows who it is", kFirstPagePort)};
}

}  // namespace

std::vector<Finding> judge_network(const NetworkFacts& facts) {
  std::vector<Finding> out{judge_environment(facts), judge_participant(facts)};
  if (!facts.fast_dds.empty()) out.push_back(judge_middleware(facts));
  for (const InterfaceFacts& interface : facts.interfaces) out.push_back(judge_interface(interface));
  const bool has_loopback = std::ranges::any_of(facts.interfaces, &InterfaceFacts::is_loopback);
  if (!has_loopback) {
    out.push_back({Level::problem, "network", "multicast.lo",
                   "there is no loopback interface with an IPv4 address",
                   "neither shells nor the browser reach a twin", "ip link set lo up"});
  }
  const bool reaches_others = std::ranges::any_of(
      facts.interfaces, [](const InterfaceFacts& i) { return !i.is_loopback && i.is_up; });
  if (!reaches_others) {
    out.push_back({Level::note, "network", "interfaces", "no interface to other machines",
                   "only programs on this machine see the twin", "connect a network if others should"});
  }
  out.push_back(judge_page_ports(facts));
  return out;
}

}  // namespace doppel::doctor
