#pragma once
// A twin's server: a Foxglove WebSocket server (subprotocol foxglove.websocket.v1) and the page in the
// browser on the same port. It lives on a thread of its own and knows the twin only as an edge of its bus.
// Binds loopback unless told otherwise; admission.h tells which clients it admits.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "doppel/bus/bus.h"
#include "doppel/core/log.h"
#include "doppel/export.h"
#include "doppel/server/asset_library.h"

namespace doppel {

struct ServerOptions {
  std::string host = "127.0.0.1";          // an address of this machine, or a name of it
  std::uint16_t port = 8700;               // 0: any
  bool any_free_port = true;               // if it is taken: the next free one, up to twenty further
  std::string token{};                     // asked of everybody; empty: none, but beyond loopback one is made
  std::string name = "doppel";             // as clients show it
  std::filesystem::path page_folder{};     // of the built page; empty or not there: a small page in its place
  std::shared_ptr<AssetLibrary> assets{};  // what clients may fetch; null: nothing
  std::size_t max_clients = 32;
  // Of what a client sends, bytes: an uncompressed picture of 1920 x 1080 has 6 MiB, the longest requests in
  // text (subscriptions to thousands of topics) some 100 KiB.
  std::size_t max_message = std::size_t{16} << 20, max_text = std::size_t{1} << 20;
  // Of what a client sends, and how much of it may come at once: far above what teleoperation at 1 kHz sends,
  // and little enough that nobody else notices. Who sends more is closed.
  double messages_per_second = 5000, message_burst = 10'000;
  double bytes_per_second = 100e6, byte_burst = 200e6;
  std::size_t client_queue_bytes = std::size_t{16}
                                   << 20;  // what may wait for a slow client before messages are skipped
  std::chrono::milliseconds http_timeout{10'000};  // for a whole request, and between two
};

class DOPPEL_API Server {
 public:
  // Listens when it returns. Throws InputError if there is no port to listen on. `bus` and `log` have to
  // outlive it.
  Server(Bus& bus, ServerOptions options, const Log& log);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::string url() const;          // "ws://127.0.0.1:8700", with the token if there is one
  [[nodiscard]] std::string page_url() const;     // "http://127.0.0.1:8700", the same
  [[nodiscard]] std::string own_address() const;  // for programs on this machine: "127.0.0.1"
  [[nodiscard]] const std::string& token() const;
  // Messages that were skipped for clients that did not keep up.
  [[nodiscard]] std::uint64_t skipped() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
