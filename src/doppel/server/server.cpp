#include "doppel/server/server.h"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <set>
#include <thread>

#include "doppel/core/diagnostic.h"
#include "doppel/server/announcement.h"
#include "doppel/server/http_answers.h"
#include "doppel/server/hub.h"
#include "doppel/server/send_queue.h"

// The sockets: one thread, one io_context, callbacks. What a client means is the hub's business. Handlers
// hold their connection alive and, once the server stops, are dropped unrun with the io_context.

namespace doppel {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr int kPortsToTry = 20;
constexpr std::size_t kPendingHttp = 32;          // connections that are no clients (yet)
constexpr std::size_t kMostMessagesAtOnce = 256;  // from the bus, before clients are heard again
constexpr std::size_t kAnswersBeforePause = std::size_t{4}
                                            << 20;  // unsent; then nothing more is read from that client
constexpr auto kTick = std::chrono::milliseconds(50);
constexpr auto kHttpPatience = std::chrono::seconds(10);
constexpr auto kFarewell = std::chrono::milliseconds(100);

using Request = http::request<http::string_body>;
using RequestParser = http::request_parser<http::string_body>;

// What connections need of the server.
struct Context {
  const ServerOptions& options;
  Hub& hub;
  std::string url;
  std::atomic<std::uint64_t> skipped{0};
  std::function<void()> joined = [] {};
  std::set<class WebSocketSession*> sessions;
  std::size_t connections = 0;  // HTTP and WebSocket
};

class WebSocketSession : public ClientLink, public std::enable_shared_from_this<WebSocketSession> {
 public:
  WebSocketSession(tcp::socket socket, Context& context)
      : context_(context), socket_(std::move(socket)), queue_(context.options.client_queue_bytes) {
    context_.sessions.insert(this);
  }
  ~WebSocketSession() override = default;

  void accept(const Request& request, std::string_view subprotocol) {
    beast::get_lowest_layer(socket_).expires_never();
    websocket::stream_base::timeout patience{};
    patience.handshake_timeout = std::chrono::seconds(10);
    patience.idle_timeout = std::chrono::seconds(60);  // with pings; who answers none is gone
    patience.keep_alive_pings = true;
    socket_.set_option(patience);
    socket_.set_option(websocket::stream_base::decorator([subprotocol](websocket::response_type& response) {
      response.set(http::field::sec_websocket_protocol,
                   beast::string_view(subprotocol.data(), subprotocol.size()));
      response.set(http::field::server, "doppel");
    }));
    socket_.read_message_max(context_.options.max_message);
    socket_.auto_fragment(false);
    error_code ignored;
    beast::get_lowest_layer(socket_).socket().set_option(tcp::no_delay(true), ignored);
    socket_.async_accept(request, [self = shared_from_this()](error_code failed) {
      if (failed) return self->end();
      self->id_ = self->context_.hub.join(*self);
      self->context_.joined();
      self->read();
    });
  }

  void send(OutgoingFrame frame) override {
    if (closing_) return;
    context_.skipped += queue_.push(std::move(frame));
    if (queue_.answer_bytes() > 4 * context_.options.client_queue_bytes + kAnswersBeforePause) {
      return close(websocket::close_code::try_again_later, "this client does not read what it asked for");
    }
    write();
  }

  void close(websocket::close_code code, std::string_view reason) {
    if (closing_) return;
    closing_ = true;
    queue_.clear();
    constexpr std::size_t kMostReason = 123;  // RFC 6455, 5.5
    const std::string_view short_reason = reason.substr(0, kMostReason);
    // Not at once: the caller may be in the middle of the hub's work.
    asio::post(socket_.get_executor(), [self = shared_from_this(), code, text = std::string(short_reason)] {
      self->leave();
      self->socket_.async_close({code, text}, [self](error_code) { self->end(); });
    });
  }

 private:
  void read() {
    reading_ = true;
    socket_.async_read(buffer_, [self = shared_from_this()](error_code failed, std::size_t) {
      self->reading_ = false;
      if (failed) return self->end();
      self->received();
    });
  }

  void received() {
    if (closing_) return;
    const auto data = buffer_.cdata();
    const auto* bytes = static_cast<const std::byte*>(data.data());
    const Status status = socket_.got_text()
                              ? context_.hub.on_text(id_, {reinterpret_cast<const char*>(bytes), data.size()})
                              : context_.hub.on_binary(id_, {bytes, data.size()});
    buffer_.consume(buffer_.size());
    if (!status) return close(websocket::close_code::protocol_error, status.why());
    read_on();
  }

  // A client that asks but does not read is not heard until it has read.
  void read_on() {
    if (!reading_ && !closing_ && !ended_ && queue_.answer_bytes() < kAnswersBeforePause) read();
  }

  void write() {
    if (writing_ || closing_ || ended_) return;
    auto frame = queue_.pop();
    if (!frame) return;
    writing_ = true;
    in_flight_ = std::move(*frame);
    socket_.text(in_flight_.text);
    const std::array<asio::const_buffer, 2> buffers{
        asio::buffer(in_flight_.head.data(), in_flight_.head_size),
        asio::buffer(in_flight_.body.data(), in_flight_.body.size())};
    socket_.async_write(buffers, [self = shared_from_this()](error_code failed, std::size_t) {
      self->writing_ = false;
      self->in_flight_ = {};
      if (failed) return self->end();
      self->write();
      self->read_on();
    });
  }

  void leave() {
    if (id_ != 0) context_.hub.leave(std::exchange(id_, 0));
  }

  void end() {
    if (std::exchange(ended_, true)) return;
    closing_ = true;
    queue_.clear();
    leave();
    error_code ignored;
    beast::get_lowest_layer(socket_).socket().close(ignored);
    context_.sessions.erase(this);
    --context_.connections;
  }

  Context& context_;
  websocket::stream<beast::tcp_stream> socket_;
  beast::flat_buffer buffer_;
  SendQueue queue_;
  OutgoingFrame in_flight_;
  Hub::ClientId id_ = 0;
  bool reading_ = false, writing_ = false, closing_ = false, ended_ = false;
};

class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(tcp::socket socket, Context& context) : context_(context), stream_(std::move(socket)) {
    parser_.header_limit(8192);
    parser_.body_limit(1024);
  }

  void start() {
    stream_.expires_after(kHttpPatience);
    http::async_read(stream_, buffer_, parser_, [self = shared_from_this()](error_code failed, std::size_t) {
      if (failed) return self->end();
      self->answer(self->parser_.get());
    });
  }

 private:
  void answer(const Request& request) {
    const auto view = [](beast::string_view text) { return std::string_view(text.data(), text.size()); };
    const std::string_view origin = view(request[http::field::origin]);
    if (is_local_host(context_.options.host) && !is_local_host(view(request[http::field::host]))) {
      return reply(http_problem(403, "this server speaks only to its own machine; call it localhost"));
    }
    if (request.find(http::field::origin) != request.end() && !is_local_origin(origin)) {
      return reply(http_problem(403, "pages from elsewhere may not speak to the twin"));
    }
    if (!websocket::is_upgrade(request)) {
      const HttpFacts facts{.name = context_.options.name,
                            .url = context_.url,
                            .clients = context_.hub.clients(),
                            .topics = context_.hub.topic_count(),
                            .sim_time = to_seconds(context_.hub.now())};
      return reply(answer_http(view(request.method_string()), view(request.target()), facts));
    }
    const std::string_view subprotocol =
        choose_subprotocol(view(request[http::field::sec_websocket_protocol]));
    if (subprotocol.empty()) return reply(http_problem(400, "the subprotocol here is foxglove.websocket.v1"));
    if (context_.sessions.size() >= context_.options.max_clients) {
      return reply(
          http_problem(503, fmt::format("{} clients are the most here", context_.options.max_clients)));
    }
    std::make_shared<WebSocketSession>(stream_.release_socket(), context_)->accept(request, subprotocol);
  }

  void reply(HttpAnswer answer) {
    response_.result(answer.status);
    response_.version(parser_.get().version());
    response_.keep_alive(false);
    response_.set(http::field::server, "doppel");
    response_.set(http::field::content_type, answer.content_type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("X-Content-Type-Options", "nosniff");
    const std::size_t size = answer.body.size();
    if (parser_.get().method() != http::verb::head) response_.body() = std::move(answer.body);
    response_.content_length(size);
    http::async_write(stream_, response_, [self = shared_from_this()](error_code, std::size_t) {
      error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
      self->end();
    });
  }

  void end() { --context_.connections; }

  Context& context_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  RequestParser parser_;
  http::response<http::string_body> response_;
};

std::string port_holder(std::uint16_t port) {
  for (const RunningTwin& twin : find_running()) {
    if (twin.port == port) return fmt::format("the twin of {} (process {})", twin.robot, twin.pid);
  }
  return fmt::format("another program ('ss -ltnp sport = :{}' shows which)", port);
}

tcp::acceptor listen(asio::io_context& io, const ServerOptions& options) {
  error_code failed;
  const auto address = asio::ip::make_address(options.host, failed);
  if (failed) {
    throw InputError("server.host", {}, fmt::format("'{}' is no address to listen on", options.host),
                     "use 127.0.0.1, ::1 or an address of this machine");
  }
  const int tries = options.any_free_port && options.port != 0 ? kPortsToTry + 1 : 1;
  for (int i = 0; i < tries && options.port + i <= 0xFFFF; ++i) {
    const tcp::endpoint endpoint(address, static_cast<std::uint16_t>(options.port + i));
    tcp::acceptor acceptor(io);
    acceptor.open(endpoint.protocol(), failed);
    if (!failed) acceptor.set_option(tcp::acceptor::reuse_address(true), failed);
    if (!failed) acceptor.bind(endpoint, failed);
    if (!failed) acceptor.listen(asio::socket_base::max_listen_connections, failed);
    if (!failed) return acceptor;
    if (failed != asio::error::address_in_use) break;
  }
  if (failed != asio::error::address_in_use) {
    throw InputError(
        "server.listen", {},
        fmt::format("cannot listen on {} port {}: {}", options.host, options.port, failed.message()));
  }
  const std::string ports = tries == 1
                                ? fmt::format("port {} is", options.port)
                                : fmt::format("ports {} to {} are", options.port, options.port + tries - 1);
  throw InputError("server.port_taken", {}, fmt::format("{} in use by {}", ports, port_holder(options.port)),
                   "end that program, or choose another port with --port N");
}

}  // namespace

struct Server::Impl {
  Impl(Bus& bus, ServerOptions wanted)
      : options(std::move(wanted)),
        acceptor(listen(io, options)),
        hub(bus, {.name = options.name},
            [this](std::function<void()> task) { asio::post(io, std::move(task)); }),
        context{.options = options, .hub = hub, .url = "", .sessions = {}},
        bus_readable(io, dup(hub.readable_fd())),
        tick_timer(io) {
    const std::string host =
        options.host.find(':') == std::string::npos ? options.host : "[" + options.host + "]";
    port = acceptor.local_endpoint().port();
    context.url = fmt::format("ws://{}:{}", host, port);
    context.joined = [this] { start_ticking(); };
    accept();
    follow_bus();
    thread = std::thread([this] { io.run(); });
  }

  ~Impl() {
    asio::post(io, [this] { stop(); });
    thread.join();
  }

  void accept() {
    acceptor.async_accept([this](error_code failed, tcp::socket socket) {
      if (failed == asio::error::operation_aborted || stopping) return;
      if (!failed && context.connections < options.max_clients + kPendingHttp) {
        ++context.connections;
        std::make_shared<HttpSession>(std::move(socket), context)->start();
      }
      if (!failed) return accept();
      // Out of file descriptors, most likely: try again when some have been given back.
      accept_retry.expires_after(std::chrono::milliseconds(100));
      accept_retry.async_wait([this](error_code aborted) {
        if (!aborted && !stopping) accept();
      });
    });
  }

  void follow_bus() {
    bus_readable.async_wait(asio::posix::stream_descriptor::wait_read, [this](error_code failed) {
      if (!failed && !stopping) drain_bus();
    });
  }

  void drain_bus() {
    if (stopping) return;
    if (!hub.pump(kMostMessagesAtOnce)) return follow_bus();
    asio::post(io, [this] { drain_bus(); });
  }

  void start_ticking() {
    if (std::exchange(ticking, true)) return;
    tick();
  }

  void tick() {
    tick_timer.expires_after(kTick);
    tick_timer.async_wait([this](error_code failed) {
      ticking = !failed && !stopping && hub.clients() > 0;
      if (!ticking) return;
      hub.tick();
      tick();
    });
  }

  // Says goodbye to the clients, but waits for nobody for long.
  void stop() {
    stopping = true;
    error_code ignored;
    acceptor.close(ignored);
    accept_retry.cancel();
    tick_timer.cancel();
    bus_readable.close(ignored);
    for (WebSocketSession* session : context.sessions) {
      session->close(websocket::close_code::going_away, "the twin has ended");
    }
    wait_for_farewells(std::chrono::steady_clock::now() + kFarewell);
  }

  void wait_for_farewells(std::chrono::steady_clock::time_point until) {
    if (context.sessions.empty() || std::chrono::steady_clock::now() > until) return io.stop();
    tick_timer.expires_after(std::chrono::milliseconds(2));
    tick_timer.async_wait([this, until](error_code) { wait_for_farewells(until); });
  }

  ServerOptions options;
  std::uint16_t port = 0;
  asio::io_context io{1};
  tcp::acceptor acceptor;
  Hub hub;  // after io: its edge goes first, and with it whoever posts to io
  Context context;
  asio::posix::stream_descriptor bus_readable;
  asio::steady_timer tick_timer, accept_retry{io};
  bool ticking = false, stopping = false;
  std::thread thread;
};

Server::Server(Bus& bus, ServerOptions options, const Log& log) {
  const std::uint16_t wanted = options.port;
  impl_ = std::make_unique<Impl>(bus, std::move(options));
  if (wanted != 0 && port() != wanted) {
    log.note("server",
             fmt::format("port {} is in use by {}; listening on {}", wanted, port_holder(wanted), port()));
  }
}

Server::~Server() = default;

std::uint16_t Server::port() const {
  return impl_->port;
}
std::string Server::url() const {
  return impl_->context.url;
}
std::uint64_t Server::skipped() const {
  return impl_->context.skipped;
}

}  // namespace doppel
