#pragma once
// The twin's one door: a Foxglove WebSocket server (subprotocol foxglove.websocket.v1) and a small HTTP page
// on the same port. It lives on a thread of its own and knows the twin only as an edge of its bus. Binds
// loopback unless told otherwise, and turns away browsers' pages from elsewhere.

#include <cstdint>
#include <memory>
#include <string>

#include "doppel/bus/bus.h"
#include "doppel/core/log.h"

namespace doppel {

struct ServerOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 8700;    // 0: any
  bool any_free_port = true;    // if it is taken: the next free one, up to twenty further
  std::string name = "doppel";  // as clients show it
  std::size_t max_clients = 32;
  std::size_t max_message = std::size_t{16} << 20;  // bytes, of one that a client sends
  std::size_t client_queue_bytes = std::size_t{16}
                                   << 20;  // what may wait for a slow client before messages are skipped
};

class Server {
 public:
  // Listens when it returns. Throws InputError if there is no port to listen on. `bus` and `log` have to
  // outlive it.
  Server(Bus& bus, ServerOptions options, const Log& log);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::string url() const;  // "ws://127.0.0.1:8700"
  // Messages that were skipped for clients that did not keep up.
  [[nodiscard]] std::uint64_t skipped() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
