#pragma once
// The common part of the server's connections. One thread, one io_context, callbacks; the hub interprets
// frames. Handlers keep their connection alive and, once the server stops, are destroyed with the io_context
// without being called.

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <string>

#include "doppel/ros/server/admission.h"
#include "doppel/ros/server/detail/http_files.h"
#include "doppel/ros/server/detail/page_files.h"
#include "doppel/ros/server/detail/range_files.h"
#include "doppel/ros/server/hub.h"
#include "doppel/ros/server/server.h"

namespace doppel::net {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

using Request = http::request<http::string_body>;

class HttpSession;
class WebSocketSession;

// The server's objects that connections use.
struct Context {
  const ServerOptions& options;
  Bus& bus;
  Hub& hub;
  const Admission& admission;
  PageFiles& page;
  HttpFiles& files;
  RangeFiles& ranges;
  std::string url;
  std::function<void()> joined = [] {};
  std::atomic<std::uint64_t> skipped{0};
  std::set<WebSocketSession*> clients{};
  std::set<HttpSession*> visitors{};  // connections that are not clients (yet)
  // Clients with a frame for which the hub is not ready, the longest waiting first; they are not read.
  std::deque<std::shared_ptr<WebSocketSession>> waiting{};
  std::function<void()> resume = [] {};
};

}  // namespace doppel::net
