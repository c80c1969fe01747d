#include "doppel/session/live/server_edge.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/diagnostic.h"

namespace doppel {

namespace {

// The next domain without a twin; those up to 101 have ports that no other program is given.
std::uint32_t free_domain(std::uint32_t domain) {
  constexpr std::uint32_t kDomains = 102;
  const std::vector<RunningTwin> twins = find_running();
  for (std::uint32_t i = 1; i < kDomains; ++i) {
    const std::uint32_t next = (domain + i) % kDomains;
    if (std::ranges::find(twins, next, &RunningTwin::domain) == twins.end()) return next;
  }
  return (domain + 1) % kDomains;
}

}  // namespace

ServerOptions server_options(const std::string& name, const ServerEdgeOptions& options,
                             std::shared_ptr<AssetLibrary> assets) {
  ServerOptions out;
  out.name = "doppel " + name;
  out.host = options.host;
  out.token = options.token;
  out.page_folder = options.page_folder;
  out.metadata = options.metadata;
  if (options.emulated) out.metadata.emplace_back("emulated", "true");
  out.playback = options.playback;
  out.assets = std::move(assets);
  if (options.port != 0) {
    out.port = static_cast<std::uint16_t>(options.port);
    out.any_free_port = false;
  }
  return out;
}

ServerEdge::ServerEdge(Bus& bus, const std::string& robot, const ServerEdgeOptions& options,
                       std::shared_ptr<AssetLibrary> assets, const Log& log)
    : log_(log),
      server_(bus, server_options(robot, options, std::move(assets)), log),
      announcement_(robot, server_.port(), server_.own_address(), server_.token()) {
  if (options.emulated) announcement_.mark_emulated();
  if (announcement_.problem().empty()) return;
  log.warning("server",
              fmt::format("other shells cannot find this twin automatically: {}; use --port {} there",
                          announcement_.problem(), server_.port()));
}

void ServerEdge::enter_domain(std::uint32_t domain, std::vector<std::string> nodes) {
  const std::string before = announcement_.problem();
  const auto other = announcement_.enter_domain(domain, std::move(nodes));
  if (announcement_.problem() != before) {
    log_.warning("server",
                 fmt::format("a twin that starts in this domain may get the same names of nodes: {}",
                             announcement_.problem()));
  }
  if (!other) return;
  throw InputError(
      "ros.names_taken", {},
      fmt::format(
          "{} is in ROS 2 domain {} with the same names of nodes: the topics and commands of both would mix",
          other->label(), domain),
      fmt::format(
          "give one of them a domain of its own: --domain {}; or a namespace: --ros-args -r __ns:=/second -r "
          "/clock:=clock; or keep it off the ROS 2 network: --no-ros",
          free_domain(domain)));
}

std::string ServerEdge::banner() const {
  return fmt::format("  server       {}  (Foxglove WebSocket; from another shell: doppel topic list)\n",
                     server_.url());
}

std::string ServerEdge::page_line() const {
  return fmt::format("\n  page         {}{}\n", server_.page_url(),
                     server_.token().empty() ? "" : "  (anyone with this URL can move the robot)");
}

void check_address(const ServerEdgeOptions& options) {
  check_address(server_options("", options, nullptr));
}

}  // namespace doppel
