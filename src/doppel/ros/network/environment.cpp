#include "doppel/ros/network/environment.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cstdlib>
#include <utility>

#include "doppel/base/core/names.h"

namespace doppel::ros2 {
namespace {

constexpr const char* kRule = "ros.environment";

constexpr std::array<std::pair<std::string_view, DiscoveryRange>, 4> kRanges{
    {{"OFF", DiscoveryRange::off},
     {"LOCALHOST", DiscoveryRange::localhost},
     {"SUBNET", DiscoveryRange::subnet},
     {"SYSTEM_DEFAULT", DiscoveryRange::system_default}}};

std::uint32_t domain_of(std::string_view text) {
  std::uint32_t domain = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), domain);
  if (error != std::errc{} || end != text.data() + text.size() || domain > kLastDomain)
    throw InputError(kRule, {}, fmt::format("ROS_DOMAIN_ID is '{}', which is not a valid domain", text),
                     fmt::format("set it to a number from 0 to {}, or unset it for 0", kLastDomain));
  return domain;
}

DiscoveryRange range_of(std::string_view text, Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (const auto& [name, range] : kRanges) {
    if (name == text) return range;
    names.emplace_back(name);
  }
  diagnostics.warning(kRule, {},
                      fmt::format("ROS_AUTOMATIC_DISCOVERY_RANGE is '{}', which is not a valid value{}", text,
                                  did_you_mean(text, names)),
                      "LOCALHOST is used, as in ROS 2");
  return DiscoveryRange::localhost;
}

std::vector<std::string> split_peers(std::string_view text) {
  std::vector<std::string> peers;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(';', at), text.size());
    if (end > at) peers.emplace_back(text.substr(at, end - at));
    at = end + 1;
  }
  return peers;
}

}  // namespace

ParticipantOptions from_environment(const std::function<const char*(const char*)>& lookup,
                                    Diagnostics& diagnostics) {
  const auto value = [&](const char* name) {
    const char* const text = lookup(name);
    return std::string_view(text == nullptr ? "" : text);
  };
  ParticipantOptions options;
  if (const auto domain = value("ROS_DOMAIN_ID"); !domain.empty()) options.domain = domain_of(domain);
  if (const auto range = value("ROS_AUTOMATIC_DISCOVERY_RANGE"); !range.empty())
    options.range = range_of(range, diagnostics);
  options.static_peers = split_peers(value("ROS_STATIC_PEERS"));

  if (const auto only = value("ROS_LOCALHOST_ONLY"); !only.empty()) {
    const bool on = only == "1";
    if (on) {
      options.range = DiscoveryRange::localhost;
      options.static_peers.clear();
    }
    diagnostics.warning(
        kRule, {},
        fmt::format("ROS_LOCALHOST_ONLY is deprecated; {}",
                    on ? "its value 1 overrides ROS_AUTOMATIC_DISCOVERY_RANGE and ROS_STATIC_PEERS"
                       : "only the value 1 has an effect"),
        "use ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST");
  }
  const bool takes_peers =
      options.range == DiscoveryRange::localhost || options.range == DiscoveryRange::subnet;
  if (!takes_peers && !options.static_peers.empty()) {
    options.static_peers.clear();
    diagnostics.warning(
        kRule, {},
        "ROS_STATIC_PEERS is ignored if ROS_AUTOMATIC_DISCOVERY_RANGE is OFF or SYSTEM_DEFAULT, as in ROS 2",
        "unset it, or use LOCALHOST or SUBNET");
  }
  return options;
}

std::optional<Distro> distro_from_environment(const std::function<const char*(const char*)>& lookup,
                                              Diagnostics& diagnostics) {
  const char* const text = lookup("ROS_DISTRO");
  const std::string_view name = text == nullptr ? "" : text;
  if (name.empty()) return std::nullopt;
  const std::optional<Distro> distro = name == "rolling" ? kLastDistro : distro_of(name);
  if (!distro) {
    diagnostics.note(
        kRule, {},
        fmt::format("ROS_DISTRO is '{}', whose messages are not known here; those of {} are used", name,
                    title(ros_distro())),
        fmt::format("choose a distribution with --distro: {}", fmt::join(kDistroNames, ", ")));
  }
  return distro;
}

void forget_statistics() {
  ::unsetenv("FASTDDS_STATISTICS");
}

std::string_view to_string(DiscoveryRange range) {
  switch (range) {
    case DiscoveryRange::off:
      return "off";
    case DiscoveryRange::localhost:
      return "localhost";
    case DiscoveryRange::subnet:
      return "subnet";
    case DiscoveryRange::system_default:
      return "system default";
  }
  return "";
}

}  // namespace doppel::ros2
