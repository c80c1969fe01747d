#pragma once
// A twin's server: a Foxglove WebSocket server (subprotocol foxglove.websocket.v1) and the web page on the
// same port. It has its own thread and accesses the twin only through an edge of its bus. It binds to
// loopback by default; admission.h decides which clients are accepted.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/server/asset_library.h"
#include "doppel/ros/server/playback_control.h"
#include "doppel/ros/server/range_files.h"

namespace doppel {

struct ServerOptions {
  std::string host = "127.0.0.1";  // an address of this machine, or a name of it
  std::uint16_t port = 8700;       // 0: any
  bool any_free_port = true;       // if it is in use: the next free one of the following twenty
  std::string token{};             // required of all clients; empty: none on loopback, else a new one
  std::string name = "doppel";     // in serverInfo
  std::vector<std::pair<std::string, std::string>> metadata{};  // in serverInfo, for the page
  std::filesystem::path page_folder{};          // of the built page; without one a small page is served
  std::shared_ptr<AssetLibrary> assets{};       // files that clients may fetch; nullptr: none
  std::shared_ptr<PlaybackControl> playback{};  // of a recording; nullptr: none is played
  std::vector<RangeFile> range_files{};         // further files, at addresses of their own
  std::size_t max_clients = 32;
  // Largest frames of a client, bytes: an uncompressed image of 1920 x 1080 has 6 MiB, the longest text
  // requests (subscriptions to thousands of topics) some 100 KiB.
  std::size_t max_message = std::size_t{16} << 20, max_text = std::size_t{1} << 20;
  // Rates and bursts of a client's frames: far above teleoperation at 1 kHz, and low enough not to affect
  // other clients. A client that exceeds them is disconnected.
  double messages_per_second = 5000, message_burst = 10'000;
  double bytes_per_second = 100e6, byte_burst = 200e6;
  std::size_t client_queue_bytes = std::size_t{16}
                                   << 20;  // queue of a slow client, beyond which messages are skipped
  std::chrono::milliseconds http_timeout{10'000};  // for a whole request, and between two requests
};

// Throws InputError, as the server's constructor does, if there is no such host or no such port is available.
DOPPEL_API void check_address(const ServerOptions& options);

class DOPPEL_API Server {
 public:
  // Listens when it returns. Throws InputError if no port is available. `bus` and `log` outlive the server.
  Server(Bus& bus, ServerOptions options, const Log& log);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::string url() const;          // "ws://127.0.0.1:8700", with the token if there is one
  [[nodiscard]] std::string page_url() const;     // "http://127.0.0.1:8700", the same
  [[nodiscard]] std::string own_address() const;  // for programs on this machine: "127.0.0.1"
  [[nodiscard]] const std::string& token() const;
  // The number of messages skipped for slow clients. Any thread.
  [[nodiscard]] std::uint64_t skipped() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
