#include "doppel/ros/server/server.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <set>
#include <thread>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/guarded_thread.h"
#include "doppel/ros/server/detail/http_session.h"
#include "doppel/ros/server/detail/listening.h"
#include "doppel/ros/server/detail/websocket_session.h"

namespace doppel {

using namespace net;  // NOLINT: the one file that combines the server's parts

namespace {

constexpr std::size_t kMaxPendingConnections =
    64;                                          // connections that are not clients (yet); a page opens six
constexpr std::size_t kMaxMessagesAtOnce = 256;  // from the bus, before clients are read again
constexpr std::size_t kMaxReported = 20;         // different exceptions
constexpr auto kTick = std::chrono::milliseconds(50);
constexpr auto kCloseTimeout = std::chrono::milliseconds(100);

std::string checked_token(const ServerOptions& options, bool loopback) {
  if (options.token.empty()) return loopback ? "" : make_token();
  if (const Status status = check_token(options.token); !status) {
    throw InputError("server.token", {}, fmt::format("the token cannot be used: {}", status.why()),
                     "omit --token to generate one");
  }
  return options.token;
}

}  // namespace

struct Server::Impl {
  Impl(Bus& bus, ServerOptions wanted, const Log& to)
      : options(std::move(wanted)),
        log(to),
        page(options.page_folder),
        context{.options = options,
                .bus = bus,
                .hub = hub,
                .admission = admission,
                .page = page,
                .files = files,
                .ranges = ranges,
                .url = ""},
        acceptor(listen(io, options)),
        address(acceptor.local_endpoint().address()),
        port(acceptor.local_endpoint().port()),
        token(checked_token(options, address.is_loopback())),
        admission(options.host, address.is_loopback(), token, port),
        files(options.assets, [this](std::function<void()> task) { asio::post(io, std::move(task)); }),
        ranges(options.range_files, [this](std::function<void()> task) { asio::post(io, std::move(task)); }),
        hub(bus,
            {.name = options.name,
             .assets = options.assets,
             .metadata = options.metadata,
             .playback = options.playback},
            [this](std::function<void()> task) {
              asio::post(io, [this, task = std::move(task)] {
                task();
                resume_waiting();
              });
            }),
        bus_readable(io, dup(hub.readable_fd())),
        tick_timer(io) {
    context.url = fmt::format("ws://{}:{}", reachable_host(address), port);
    context.joined = [this] { start_ticking(); };
    context.resume = [this] { resume_waiting(); };
    accept();
    follow_bus();
    thread = guarded_thread(
        [this] { run(); },
        [this](const std::string& what) {
          log.error("server", fmt::format("the server has stopped, clients can no longer connect: {}", what));
        });
  }

  ~Impl() {
    asio::post(io, [this] { stop(); });
    thread.join();
  }

  // An exception of a client's handler closes only that client's connection.
  void run() {
    while (!catch_errors([this] { io.run(); })) {
    }
  }

  // False: it threw. Each different text is reported once.
  template <class Work>
  bool catch_errors(const Work& work) {
    try {
      work();
      return true;
    } catch (...) {
      const std::string what = thrown_text();
      if (reported.size() < kMaxReported && reported.insert(what).second)
        log.error("server",
                  fmt::format("the server continues after: {}; repetitions are not reported", what));
      return false;
    }
  }

  void accept() {
    acceptor.async_accept([this](error_code failed, tcp::socket socket) {
      if (failed == asio::error::operation_aborted || stopping) return;
      if (!failed) {
        catch_errors([&] {
          if (context.visitors.size() >= kMaxPendingConnections) close_longest_waiting();
          std::make_shared<HttpSession>(std::move(socket), context)->read();
        });
        return accept();
      }
      // Probably out of file descriptors: retried when some may have been closed.
      accept_retry.expires_after(std::chrono::milliseconds(100));
      accept_retry.async_wait([this](error_code aborted) {
        if (!aborted && !stopping) accept();
      });
    });
  }

  // Closes the connection that has been waiting longest for a request: an idle or a very slow one.
  void close_longest_waiting() {
    const auto longest = std::ranges::min_element(context.visitors, {}, &HttpSession::waiting_since);
    if (longest != context.visitors.end()) (*longest)->close();
  }

  void follow_bus() {
    bus_readable.async_wait(asio::posix::stream_descriptor::wait_read, [this](error_code failed) {
      if (!failed && !stopping) drain_bus();
    });
  }

  void drain_bus() {
    if (stopping) return;
    bool more = false;
    catch_errors([&] {
      more = hub.pump(kMaxMessagesAtOnce);
      resume_waiting();
    });
    if (!more) return follow_bus();
    asio::post(io, [this] { drain_bus(); });
  }

  // Passes on the frames of clients for which the hub is ready by now: one of each, so that they take turns.
  void resume_waiting() {
    if (stopping) return;
    for (std::size_t left = context.waiting.size(); left > 0; --left) {
      const std::shared_ptr<WebSocketSession> client = std::move(context.waiting.front());
      context.waiting.pop_front();
      if (!client->resume()) context.waiting.push_back(client);
    }
    hub.wake_when_served(!context.waiting.empty());
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
      catch_errors([this] {
        hub.tick();
        resume_waiting();
      });
      tick();
    });
  }

  // Sends the close frame to the clients, and waits for them only for a short time.
  void stop() {
    stopping = true;
    error_code ignored;
    acceptor.close(ignored);
    accept_retry.cancel();
    tick_timer.cancel();
    bus_readable.close(ignored);
    context.waiting.clear();
    for (WebSocketSession* client : context.clients) {
      client->close(websocket::close_code::going_away, "the twin has ended");
    }
    wait_for_close_frames(std::chrono::steady_clock::now() + kCloseTimeout);
  }

  void wait_for_close_frames(std::chrono::steady_clock::time_point until) {
    if (context.clients.empty() || std::chrono::steady_clock::now() > until) return io.stop();
    tick_timer.expires_after(std::chrono::milliseconds(2));
    tick_timer.async_wait([this, until](error_code) { wait_for_close_frames(until); });
  }

  [[nodiscard]] std::string token_query() const { return token.empty() ? "" : "/?token=" + token; }

  ServerOptions options;
  const Log& log;
  std::set<std::string> reported;  // the server's thread
  PageFiles page;
  Context context;  // before io, whose destructor ends connections that use the context and the page
  asio::io_context io{1};
  tcp::acceptor acceptor;
  asio::ip::address address;
  std::uint16_t port = 0;
  std::string token;
  Admission admission;
  HttpFiles files;    // after io, to which it posts
  RangeFiles ranges;  // the same
  Hub hub;            // after io, so that its edge, which posts to io, is destroyed first
  asio::posix::stream_descriptor bus_readable;
  asio::steady_timer tick_timer, accept_retry{io};
  bool ticking = false, stopping = false;
  std::thread thread;
};

void check_address(const ServerOptions& options) {
  asio::io_context io;
  net::listen(io, options);
}

Server::Server(Bus& bus, ServerOptions options, const Log& log) {
  const std::uint16_t wanted = options.port;
  impl_ = std::make_unique<Impl>(bus, std::move(options), log);
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
  return impl_->context.url + impl_->token_query();
}
std::string Server::page_url() const {
  return "http" + impl_->context.url.substr(2) + impl_->token_query();
}
std::string Server::own_address() const {
  return net::own_address(impl_->address);
}
const std::string& Server::token() const {
  return impl_->token;
}
std::uint64_t Server::skipped() const {
  return impl_->context.skipped;
}

}  // namespace doppel
