#include "doppel/ros/server/detail/http_session.h"

#include <fmt/format.h>

#include "doppel/ros/server/detail/websocket_session.h"

namespace doppel::net {
namespace {

constexpr std::size_t kMaxHeader = 8192, kMaxBody = 1024;  // bytes; no request here has a body
constexpr std::size_t kMaxRequests = 200;                  // of one connection
constexpr auto kSendTimeout = std::chrono::seconds(30);
constexpr auto kLingerTimeout = std::chrono::milliseconds(500);
constexpr std::size_t kMaxLingeredBytes = 65536;  // bytes

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

}  // namespace

HttpSession::HttpSession(tcp::socket socket, Context& context)
    : context_(context), stream_(std::move(socket)), buffer_(2 * kMaxHeader) {
  context_.visitors.insert(this);
  error_code ignored;
  stream_.socket().set_option(tcp::no_delay(true), ignored);  // responses and frames are not delayed by Nagle
}

HttpSession::~HttpSession() {
  context_.visitors.erase(this);
}

void HttpSession::read() {
  parser_.emplace();
  parser_->header_limit(kMaxHeader);
  parser_->body_limit(kMaxBody);
  waiting_since_ = std::chrono::steady_clock::now();
  // One timeout for the whole request, also if it arrives slowly, and for the idle time before it.
  stream_.expires_after(context_.options.http_timeout);
  http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code failed, std::size_t) {
    self->waiting_since_ = std::chrono::steady_clock::time_point::max();
    if (failed) return self->unreadable(failed);
    ++self->requests_;
    self->answer(self->parser_->get());
  });
}

void HttpSession::close() {
  waiting_since_ = std::chrono::steady_clock::time_point::max();
  error_code ignored;
  stream_.socket().close(ignored);
}

void HttpSession::unreadable(error_code why) {
  requests_ = kMaxRequests;  // later bytes cannot be distinguished from the rest of this request
  if (why == http::error::header_limit || why == http::error::buffer_overflow)
    return reply(
        http_problem(431, fmt::format("the header of a request is larger than {} bytes", kMaxHeader)));
  if (why == http::error::body_limit)
    return reply(http_problem(413, "requests with a body are not supported"));
  const bool gone = why == http::error::end_of_stream || why == http::error::partial_message;
  if (!gone && why.category() == make_error_code(http::error::bad_target).category())
    return reply(http_problem(400, "this is not an HTTP request"));
}

void HttpSession::answer(const Request& request) {
  if (request.count(http::field::host) > 1 || request.count(http::field::origin) > 1)
    return reply(http_problem(400, "the request has more than one Host or Origin"));
  Credentials who{.host = view(request[http::field::host]),
                  .target = view(request.target()),
                  .cookies = view(request[http::field::cookie]),
                  .origin = std::nullopt};
  if (request.count(http::field::origin) != 0) who.origin = view(request[http::field::origin]);
  if (const Status welcome = context_.admission.check(who); !welcome)
    return reply(http_problem(403, welcome.why()));
  if (websocket::is_upgrade(request)) return upgrade(request);
  const HttpRequest question{.method = view(request.method_string()),
                             .target = who.target,
                             .accept_encoding = view(request[http::field::accept_encoding]),
                             .if_none_match = view(request[http::field::if_none_match]),
                             .range = view(request[http::field::range]),
                             .if_range = view(request[http::field::if_range])};
  const bool reads = question.method == "GET" || question.method == "HEAD";
  const auto send = [self = shared_from_this()](HttpResponse file) { self->reply(std::move(file)); };
  if (const auto uri = requested_file(who.target); uri && reads)
    return context_.files.get(*uri, question, send);
  if (reads && context_.ranges.has(who.target)) return context_.ranges.get(question, send);
  const ServerSummary facts{.name = context_.options.name,
                            .url = context_.url,
                            .clients = context_.hub.clients(),
                            .topics = context_.hub.topic_count()};
  HttpResponse answer = http_response_to(question, context_.page, facts);
  if (std::string cookie = context_.admission.cookie_for(who.target); !cookie.empty())
    answer.headers.emplace_back("Set-Cookie", std::move(cookie));
  reply(std::move(answer));
}

void HttpSession::upgrade(const Request& request) {
  const std::string_view subprotocol = choose_subprotocol(view(request[http::field::sec_websocket_protocol]));
  if (subprotocol.empty())
    return reply(http_problem(400, "the subprotocol of this server is foxglove.websocket.v1"));
  if (context_.clients.size() >= context_.options.max_clients) {
    return reply(
        http_problem(503, fmt::format("the maximum of {} clients is reached", context_.options.max_clients)));
  }
  std::make_shared<WebSocketSession>(stream_.release_socket(), context_)->accept(request, subprotocol);
}

void HttpSession::reply(HttpResponse answer) {
  answer_ = std::move(answer);
  const bool readable = parser_->is_done();
  response_ = {};
  response_.result(answer_.status);
  response_.version(readable ? parser_->get().version() : 11);
  response_.keep_alive(readable && parser_->get().keep_alive() && requests_ < kMaxRequests);
  response_.set(http::field::server, "doppel");
  response_.set(http::field::cache_control, "no-store");
  response_.set("X-Content-Type-Options", "nosniff");
  response_.set("Referrer-Policy", "no-referrer");  // the address may contain the token
  response_.set("Cross-Origin-Resource-Policy", "same-origin");
  for (const auto& [name, value] : answer_.headers) response_.set(name, value);
  const std::string_view content = answer_.content();
  if (answer_.status != 304) {
    response_.set(http::field::content_type, answer_.content_type);
    response_.content_length(answer_.part ? answer_.part->left() : content.size());
    const bool head = readable && parser_->get().method() == http::verb::head;
    if (head) answer_.part = nullptr;
    if (!head) response_.body() = {content.data(), content.size()};
  }
  stream_.expires_after(kSendTimeout);
  http::async_write(stream_, response_, [self = shared_from_this()](error_code failed, std::size_t) {
    if (!failed) self->send_part();
  });
}

// Sends the rest of a file, piece by piece: the next one is read when the client has taken the last one.
void HttpSession::send_part() {
  if (answer_.part == nullptr || answer_.part->left() == 0) return end_response();
  context_.ranges.read(answer_.part, [self = shared_from_this()](bool whole) {
    if (!whole) return self->close();  // the client sees that the response is incomplete
    const std::span<const char> piece = self->answer_.part->piece();
    self->stream_.expires_after(kSendTimeout);
    asio::async_write(self->stream_, asio::buffer(piece.data(), piece.size()),
                      [self](error_code failed, std::size_t) {
                        if (!failed) self->send_part();
                      });
  });
}

void HttpSession::end_response() {
  answer_ = {};
  if (response_.keep_alive()) return read();
  error_code ignored;
  stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  stream_.expires_after(kLingerTimeout);
  linger();
}

// Reads for a short time what the client still sends: TCP resets a connection that is closed with unread
// bytes, and the response may be lost.
void HttpSession::linger() {
  stream_.async_read_some(asio::buffer(discarded_),
                          [self = shared_from_this()](error_code failed, std::size_t size) {
                            self->lingered_ += size;
                            if (!failed && self->lingered_ < kMaxLingeredBytes) self->linger();
                          });
}

}  // namespace doppel::net
