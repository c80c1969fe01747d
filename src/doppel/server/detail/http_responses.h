#pragma once
// What the server says to plain HTTP: the page, and how the twin is. Knows nothing of sockets.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/server/detail/page_files.h"

namespace doppel {

struct HttpResponse {
  unsigned status = 200;
  std::string content_type, body;
  std::string_view file;  // in place of the body: bytes of a page's file
  std::vector<std::pair<std::string, std::string>> headers;

  [[nodiscard]] std::string_view content() const { return file.empty() ? std::string_view(body) : file; }
};

struct HttpRequest {
  std::string_view method, target, accept_encoding, if_none_match;
};

struct ServerSummary {
  std::string name, url;
  std::size_t clients = 0, topics = 0;
};

// GET / is the page (or, where it has not been built, a small one that says how), GET /assets/NAME its parts,
// GET /health an object for programs.
HttpResponse http_response_to(const HttpRequest& question, PageFiles& page, const ServerSummary& facts);
HttpResponse http_problem(unsigned status, std::string text);

// The subprotocol to speak out of those that the client offers in Sec-WebSocket-Protocol; "": none that is
// known.
std::string_view choose_subprotocol(std::string_view offered);

}  // namespace doppel
