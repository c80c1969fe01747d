#include "doppel/session/live/server_edge.h"

#include <fmt/format.h>

namespace doppel {

ServerOptions server_options(const std::string& name, const ServerEdgeOptions& options,
                             std::shared_ptr<AssetLibrary> assets) {
  ServerOptions out;
  out.name = "doppel " + name;
  out.host = options.host;
  out.token = options.token;
  out.page_folder = options.page_folder;
  out.metadata = options.metadata;
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
    : server_(bus, server_options(robot, options, std::move(assets)), log),
      announcement_(robot, server_.port(), server_.own_address(), server_.token()) {
  if (announcement_.problem().empty()) return;
  log.warning("server",
              fmt::format("other shells cannot find this twin automatically: {}; use --port {} there",
                          announcement_.problem(), server_.port()));
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
