#pragma once
// What the server says to plain HTTP, and to whom it speaks at all. Knows nothing of sockets.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace doppel {

struct HttpAnswer {
  unsigned status = 200;
  std::string content_type, body;
};

struct HttpFacts {
  std::string name, url;
  std::size_t clients = 0, topics = 0;
  double sim_time = 0;  // s
};

// GET / is a page for people, GET /health an object for programs.
HttpAnswer answer_http(std::string_view method, std::string_view target, const HttpFacts& facts);
HttpAnswer http_problem(unsigned status, std::string text);

// "localhost:8700", "127.0.0.1", "[::1]:8700": the Host header of a request that was meant for this machine.
// A page from elsewhere whose name was made to point here (DNS rebinding) shows its own name.
bool is_local_host(std::string_view host);
// The Origin header of a page from this machine. Browsers send one, other programs need not.
bool is_local_origin(std::string_view origin);
// The subprotocol to speak out of those that the client offers in Sec-WebSocket-Protocol; "": none that is
// known.
std::string_view choose_subprotocol(std::string_view offered);

}  // namespace doppel
