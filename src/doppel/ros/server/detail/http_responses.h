#pragma once
// The server's responses to plain HTTP: the page, and the twin's health. Independent of sockets.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/ros/server/detail/page_files.h"

namespace doppel {

class FilePart;  // range_files.h

struct HttpResponse {
  unsigned status = 200;
  std::string content_type, body;
  std::string_view file;              // instead of the body: bytes of a file
  std::shared_ptr<const void> owner;  // of these bytes; nullptr: they are files of the page, which stay
  std::shared_ptr<FilePart> part{};   // instead of both: a part of a file that is read while it is sent
  std::vector<std::pair<std::string, std::string>> headers;

  [[nodiscard]] std::string_view content() const { return file.empty() ? std::string_view(body) : file; }
};

struct HttpRequest {
  std::string_view method, target, accept_encoding, if_none_match, range{}, if_range{};
};

struct ServerSummary {
  std::string name, url;
  std::size_t clients = 0, topics = 0;
};

// A file in the forms in which it is sent.
struct ServedFile {
  std::string content_type, tag;  // the tag of its content, without quotes
  std::string_view bytes, gzip;   // gzip is empty if there is none
  std::shared_ptr<const void> owner;
  bool immutable = false;  // the content of this address never changes
};

[[nodiscard]] bool accepts_gzip(std::string_view accept_encoding);
// True if the client has the file, in either form.
[[nodiscard]] bool is_known(const ServedFile& file, const HttpRequest& question);
HttpResponse file_response(const ServedFile& file, const HttpRequest& question);

// GET / is the page (or, if it is not built, a small one with the build command), GET /assets/NAME its parts,
// GET /health a JSON object for programs.
HttpResponse http_response_to(const HttpRequest& question, PageFiles& page, const ServerSummary& facts);
HttpResponse http_problem(unsigned status, std::string text);

// The supported subprotocol among those that the client offers in Sec-WebSocket-Protocol (RFC
// 6455); "": none.
std::string_view choose_subprotocol(std::string_view offered);

}  // namespace doppel
