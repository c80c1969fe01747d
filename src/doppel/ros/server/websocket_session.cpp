#include "doppel/ros/server/detail/websocket_session.h"

#include <fmt/format.h>
#include <poll.h>

#include <boost/asio/post.hpp>

#include "doppel/ros/server/detail/bundle.h"

namespace doppel::net {
namespace {

// Unsent answers of one client, and of all together; above its share of the latter a client's requests are
// not read.
constexpr std::size_t kAnswersBeforePause = std::size_t{4} << 20, kAllAnswers = std::size_t{32} << 20;

constexpr std::size_t kBufferKept = std::size_t{1} << 20;  // for the next frame, after a large one

}  // namespace

WebSocketSession::WebSocketSession(tcp::socket socket, Context& context)
    : context_(context),
      socket_(std::move(socket)),
      queue_(context.options.client_queue_bytes),
      messages_(context.options.messages_per_second, context.options.message_burst),
      bytes_(context.options.bytes_per_second, context.options.byte_burst),
      bundle_timer_(socket_.get_executor()) {
  context_.clients.insert(this);
}

WebSocketSession::~WebSocketSession() {
  context_.clients.erase(this);
}

template <class Work>
void WebSocketSession::or_end(const Work& work) {
  try {
    work();
  } catch (...) {
    end();
    throw;
  }
}

void WebSocketSession::accept(const Request& request, std::string_view subprotocol) {
  beast::get_lowest_layer(socket_).expires_never();
  bundle_period_ = bundle_period({request.target().data(), request.target().size()});
  websocket::stream_base::timeout timeouts{};
  timeouts.handshake_timeout = std::chrono::seconds(10);
  timeouts.idle_timeout = std::chrono::seconds(60);  // with pings; a client that answers none is closed
  timeouts.keep_alive_pings = true;
  socket_.set_option(timeouts);
  socket_.set_option(websocket::stream_base::decorator([subprotocol](websocket::response_type& response) {
    response.set(http::field::sec_websocket_protocol,
                 beast::string_view(subprotocol.data(), subprotocol.size()));
    response.set(http::field::server, "doppel");
  }));
  socket_.read_message_max(context_.options.max_message);
  socket_.auto_fragment(false);
  // Pings count, too, because each is answered.
  socket_.control_callback([this](websocket::frame_type, beast::string_view text) {
    if (!closing_) or_end([&] { static_cast<void>(within_limits(text.size())); });
  });
  socket_.async_accept(request, [self = shared_from_this()](error_code failed) {
    if (failed) return self->end();
    self->or_end([&] {
      self->id_ = self->context_.hub.join(*self);
      self->context_.joined();
      self->read();
    });
  });
}

void WebSocketSession::send(OutgoingFrame frame) {
  if (closing_) return;
  const bool is_message = frame.kind == OutgoingFrame::Kind::message;
  if (const std::size_t skipped = queue_.push(std::move(frame)); skipped > 0) {
    context_.skipped += skipped;
    context_.bus.add_skipped(skipped);  // published in the loop's status
  }
  if (queue_.answer_bytes() > 4 * context_.options.client_queue_bytes + kAnswersBeforePause) {
    return close(websocket::close_code::try_again_later, "this client does not read its subscriptions");
  }
  if (is_message && bundle_period_.count() > 0) write_soon();
  write();
}

// Messages wait for others of the same bundle, unless they are many already.
void WebSocketSession::write_soon() {
  if (std::exchange(gathering_, true)) return;
  bundle_timer_.expires_after(bundle_period_);
  bundle_timer_.async_wait([self = shared_from_this()](error_code failed) {
    self->gathering_ = false;
    if (!failed) self->or_end([&] { self->write(); });
  });
}

void WebSocketSession::close(websocket::close_code code, std::string_view reason) {
  if (closing_) return;
  closing_ = true;
  queue_.clear();
  constexpr std::size_t kMaxReason =
      123;  // bytes: a control frame has 125, two of them the code (RFC 6455, 5.5)
  const std::string_view short_reason = reason.substr(0, kMaxReason);
  // Posted instead of called, because the caller may be inside a function of the hub.
  asio::post(socket_.get_executor(), [self = shared_from_this(), code, text = std::string(short_reason)] {
    self->leave();
    self->socket_.async_close({code, text}, [self](error_code) { self->end(); });
  });
}

void WebSocketSession::read() {
  reading_ = true;
  socket_.async_read(buffer_, [self = shared_from_this()](error_code failed, std::size_t) {
    self->reading_ = false;
    if (failed) return self->end();
    self->or_end([&] { self->received(); });
  });
}

void WebSocketSession::received() {
  if (closing_) return;
  const auto data = buffer_.cdata();
  const std::span frame(static_cast<const std::byte*>(data.data()), data.size());
  if (!within_limits(frame.size())) return;
  if (is_hub_ready()) return hand_over();
  holding_ = true;
  context_.waiting.push_back(shared_from_this());
  context_.hub.wake_when_served(true);
  // The event that the client waits for may have happened before the wake-up was requested.
  asio::post(socket_.get_executor(), context_.resume);
}

bool WebSocketSession::is_hub_ready() const {
  const auto data = buffer_.cdata();
  const bool is_message = !socket_.got_text() && data.size() > 0 &&
                          *static_cast<const std::uint8_t*>(data.data()) == foxglove::kClientDataOpcode;
  return context_.hub.is_ready(id_, is_message);
}

// A client that is not read is not noticed to be gone, and would keep its place among the clients.
bool WebSocketSession::is_reset() {
  pollfd connection{beast::get_lowest_layer(socket_).socket().native_handle(), 0, 0};
  return poll(&connection, 1, 0) > 0 && (connection.revents & (POLLERR | POLLHUP)) != 0;
}

bool WebSocketSession::resume() {
  if (closing_ || ended_) return true;
  if (is_reset()) {
    end();
    return true;
  }
  if (!is_hub_ready()) return false;
  holding_ = false;
  or_end([this] { hand_over(); });
  return true;
}

void WebSocketSession::hand_over() {
  const auto data = buffer_.cdata();
  const std::span frame(static_cast<const std::byte*>(data.data()), data.size());
  if (socket_.got_text()) {
    context_.hub.on_text(id_, {reinterpret_cast<const char*>(frame.data()), frame.size()});
  } else {
    context_.hub.on_binary(id_, frame);
  }
  buffer_.consume(buffer_.size());
  if (buffer_.capacity() > kBufferKept) buffer_.shrink_to_fit();
  read_on();
}

bool WebSocketSession::within_limits(std::size_t bytes) {
  const auto now = MessageLimit::Clock::now();
  if (!messages_.take(1, now)) {
    close(websocket::close_code::policy_error,
          fmt::format("the limit is {} messages per second", context_.options.messages_per_second));
  } else if (!bytes_.take(static_cast<double>(bytes), now)) {
    close(websocket::close_code::policy_error,
          fmt::format("the limit is {} bytes per second", context_.options.bytes_per_second));
  } else if (socket_.got_text() && bytes > context_.options.max_text) {
    close(websocket::close_code::too_big,
          fmt::format("a text frame is larger than {} bytes", context_.options.max_text));
  }
  return !closing_;
}

std::size_t WebSocketSession::max_unsent() const {
  return std::min(kAnswersBeforePause, kAllAnswers / std::max<std::size_t>(1, context_.clients.size()));
}

// The requests of a client that does not read its responses are not read until it does.
void WebSocketSession::read_on() {
  if (!reading_ && !holding_ && !closing_ && !ended_ && queue_.answer_bytes() < max_unsent()) read();
}

void WebSocketSession::write() {
  if (writing_ || closing_ || ended_) return;
  if (gathering_ && !queue_.has_answers() && queue_.data_bytes() < kMaxBundleBytes) return;
  auto frame = bundle_period_.count() > 0 ? pop_bundle(queue_) : queue_.pop();
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
    self->or_end([&] {
      self->write();
      if (self->id_ != 0) self->context_.hub.has_room(self->id_);
      self->read_on();
    });
  });
}

void WebSocketSession::leave() {
  if (id_ != 0) context_.hub.leave(std::exchange(id_, 0));
}

void WebSocketSession::end() {
  if (std::exchange(ended_, true)) return;
  closing_ = true;
  queue_.clear();
  bundle_timer_.cancel();
  leave();
  error_code ignored;
  beast::get_lowest_layer(socket_).socket().close(ignored);
  context_.clients.erase(this);
}

}  // namespace doppel::net
