#pragma once
// The server with the page, and the announcement for other shells.

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/server/announcement.h"
#include "doppel/ros/server/server.h"

namespace doppel {

struct ServerEdgeOptions {
  int port = 0;  // 0: 8700 or the next that is free
  std::string host = "127.0.0.1", token;
  std::filesystem::path page_folder;                            // of the built page
  std::vector<std::pair<std::string, std::string>> metadata{};  // for the page, in the server's greeting
  std::shared_ptr<PlaybackControl> playback{};                  // of a recording; nullptr: none is played
  bool emulated = false;  // an arm behind a port: verbs do not choose it
};

// The options of the server with that name.
DOPPEL_API ServerOptions server_options(const std::string& name, const ServerEdgeOptions& options,
                                        std::shared_ptr<AssetLibrary> assets);

class DOPPEL_API ServerEdge {
 public:
  // Listens and is announced when it returns. Throws InputError. `bus` and `log` outlive the edge.
  ServerEdge(Bus& bus, const std::string& robot, const ServerEdgeOptions& options,
             std::shared_ptr<AssetLibrary> assets, const Log& log);

  [[nodiscard]] const Server& server() const { return server_; }
  // The nodes are about to join the domain. Throws InputError where a running twin of this user has their
  // names; logs why it cannot be made sure that no other one gets them.
  void enter_domain(std::uint32_t domain, std::vector<std::string> nodes);
  // A line with its address, for the terminal.
  [[nodiscard]] std::string banner() const;
  // The page's address, set apart: the last line of a start.
  [[nodiscard]] std::string page_line() const;

 private:
  const Log& log_;
  Server server_;
  Announcement announcement_;
};

// Throws InputError if the server could not listen, before a robot is loaded.
DOPPEL_API void check_address(const ServerEdgeOptions& options);

}  // namespace doppel
