#include "doppel/ros/client/websocket_client.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/ros/foxglove/foxglove_protocol.h"
#include "doppel/ros/foxglove/parameter_name.h"

namespace doppel {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;

constexpr auto kInterruptCheck = std::chrono::milliseconds(20);
constexpr std::size_t kMaxMessageBytes = std::size_t{256} << 20;

}  // namespace

struct WebSocketClient::Impl : ReceiveBuffer {
  explicit Impl(ClientOptions chosen) : options(std::move(chosen)) {
    connect();
    read();
    send(foxglove::to_frame(foxglove::WatchGraph{true}));
    // The server responds in order: once the graph is here, everything that it sends to a new client is.
    if (!wait([this] { return graph_known; }, Clock::now() + options.timeout)) {
      throw ClientError(fmt::format("the twin on port {} did not answer in time", options.port));
    }
  }

  ~Impl() {
    if (!open) return;
    try {
      socket.async_close(websocket::close_code::normal, [this](error_code) { open = false; });
      io.restart();
      io.run_for(std::chrono::milliseconds(500));
    } catch (const std::exception&) {
      open = false;  // closed also after an error
    }
  }

  void connect() {
    error_code failed;
    const auto address = asio::ip::make_address(options.host, failed);
    if (failed) throw ClientError(fmt::format("'{}' is not an IP address", options.host));
    auto& stream = beast::get_lowest_layer(socket);
    stream.socket().connect(tcp::endpoint(address, options.port), failed);
    if (failed) {
      throw ClientError(
          fmt::format("no twin answers on {} port {}: {}", options.host, options.port, failed.message()));
    }
    stream.socket().set_option(tcp::no_delay(true), failed);
    socket.set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
      request.set(beast::http::field::sec_websocket_protocol,
                  beast::string_view(foxglove::kSubprotocol.data(), foxglove::kSubprotocol.size()));
      request.set(beast::http::field::user_agent, "doppel");
    }));
    socket.read_message_max(kMaxMessageBytes);
    websocket::response_type response;
    bool done = false;
    const std::string target = options.token.empty() ? "/" : "/?token=" + options.token;
    socket.async_handshake(response, fmt::format("localhost:{}", options.port), target,
                           [&](error_code outcome) {
                             failed = outcome;
                             done = true;
                           });
    io.run_for(options.timeout);
    if (!done)
      throw ClientError(
          fmt::format("port {} is open, but does not answer as a WebSocket server", options.port));
    if (failed) {
      const std::string said = response.body().empty() ? failed.message() : response.body();
      throw ClientError(fmt::format("port {} refuses this client: {}", options.port, said));
    }
    open = true;
    io.restart();
  }

  void read() {
    socket.async_read(buffer, [this](error_code failed, std::size_t) {
      if (failed) {
        open = false;
        const auto reason = socket.reason();
        why_closed = reason.reason.empty() ? "the twin has ended" : std::string(reason.reason.c_str());
        return;
      }
      const auto data = buffer.cdata();
      const auto* bytes = static_cast<const std::byte*>(data.data());
      foxglove::ServerMessage message;
      const Status status =
          socket.got_text()
              ? foxglove::read_server_text({reinterpret_cast<const char*>(bytes), data.size()}, message)
              : foxglove::read_server_binary({bytes, data.size()}, message);
      if (status) std::visit([this](const auto& m) { handle(m); }, message);
      buffer.consume(buffer.size());
      read();
    });
  }

  // Handles received frames until the condition holds, or the time is over (false).
  bool wait(const std::function<bool()>& condition, Clock::time_point until) {
    while (!condition()) {
      if (!open) throw ClientError(why_closed);
      if (options.interrupted && options.interrupted()) throw Interrupted();
      const auto now = Clock::now();
      if (now >= until) return false;
      const auto slice = options.interrupted ? std::min(until, now + kInterruptCheck) : until;
      io.restart();
      io.run_one_until(slice);
    }
    return true;
  }

  void write(bool text, asio::const_buffer data) {
    if (!open) throw ClientError(why_closed);
    bool done = false;
    error_code failed;
    socket.text(text);
    socket.async_write(data, [&](error_code outcome, std::size_t) {
      failed = outcome;
      done = true;
    });
    // Frames are also read while writing, so that the two sides cannot wait for each other.
    while (!done) {
      io.restart();
      io.run_one();
    }
    if (failed)
      throw ClientError(open ? fmt::format("cannot send to the twin: {}", failed.message()) : why_closed);
  }
  void send(const std::string& text) { write(true, asio::buffer(text)); }
  void send(const foxglove::FrameBytes& bytes) { write(false, asio::buffer(bytes)); }

  void handle(std::monostate) {}
  void handle(const foxglove::ServerInfo& info) {
    name = info.name;
    // The layout of the twin's messages, whatever ROS_DISTRO is here.
    if (const std::optional<Distro> distro = distro_of(info.distro)) set_ros_distro(*distro);
  }
  void handle(const foxglove::TimeMessage&) {}
  void handle(const foxglove::AssetFailure&) {}
  void handle(const foxglove::AssetData&) {}
  void handle(const foxglove::StatusMessage& status) {
    if (status.level == foxglove::StatusLevel::error) errors.push_back(status.message);
    if (status.level == foxglove::StatusLevel::warning && options.on_status)
      options.on_status(status.message);
  }
  void handle(const foxglove::Channels& channels) {
    for (const foxglove::Channel& channel : channels.channels) {
      offers[channel.id] = channel;
      Topic& topic = topics[channel.topic];
      topic.type = channel.schema_name;
      topic.schema = channel.schema;
      if (wanted.contains(channel.topic) && !wanted[channel.topic]) ask_for(channel.topic);
    }
  }
  void handle(const foxglove::RemovedChannels& removed) {
    for (const std::uint32_t id : removed.ids) {
      const auto found = offers.find(id);
      if (found == offers.end()) continue;
      if (wanted.contains(found->second.topic)) wanted[found->second.topic] = false;  // it may come back
      topics.erase(found->second.topic);
      offers.erase(found);
    }
  }
  void handle(const foxglove::Services& list) {
    for (const foxglove::ServiceOffer& service : list.services) {
      service_ids[service.name] = service.id;
      services[service.name].type = service.type;
    }
  }
  void handle(const foxglove::RemovedServices& removed) {
    std::erase_if(service_ids, [&](const auto& entry) {
      const bool gone = std::ranges::find(removed.ids, entry.second) != removed.ids.end();
      if (gone) services.erase(entry.first);
      return gone;
    });
  }
  void handle(const foxglove::GraphUpdate& update) {
    const auto enter = [this](const std::string& of, const std::vector<std::string>& nodes,
                              std::vector<std::string> Topic::*names, std::vector<Endpoint> Topic::*ends) {
      Topic& topic = topics[of];
      topic.*names = nodes;
      (topic.*ends).clear();
      for (const std::string& node : nodes) (topic.*ends).push_back({node, topic.type, {}, {}, {}});
    };
    for (const auto& [topic, ids] : update.published)
      enter(topic, ids, &Topic::publishers, &Topic::publisher_ends);
    for (const auto& [topic, ids] : update.subscribed)
      enter(topic, ids, &Topic::subscribers, &Topic::subscriber_ends);
    for (const auto& [service, ids] : update.services) services[service].providers = ids;
    graph_known = true;
  }
  void handle(const foxglove::ParameterValues& values) {
    if (values.id.empty()) return;
    answered_request = values.id;
    parameters = values.parameters;
  }
  void handle(const foxglove::ServiceFailure& failure) {
    answers[failure.call] = {false, failure.message, {}};
  }
  void handle(const foxglove::ServiceResponse& response) {
    answers[response.call] = {true, "", Bytes(response.payload.begin(), response.payload.end())};
  }
  void handle(const foxglove::MessageData& data) {
    const auto offer =
        offers.find(data.subscription);  // this client uses the channel's id as subscription id
    if (offer == offers.end()) return;
    keep({offer->second.topic, offer->second.schema_name, data.stamp,
          Bytes(data.payload.begin(), data.payload.end())});
  }

  // Queued for the next write outside of a handler.
  void ask_for(const std::string& topic) {
    wanted[topic] = true;
    late_subscriptions.push_back(topic);
  }

  void subscribe_now(const std::string& topic) {
    for (const auto& [id, offer] : offers) {
      if (offer.topic == topic) return send(foxglove::to_frame(foxglove::Subscribe{{{id, id}}}));
    }
  }

  // The response to a request with an id; refusals of the server in the meantime are in `errors`.
  void await_request(const std::string& id) {
    if (!wait([&] { return answered_request == id; }, Clock::now() + options.timeout)) {
      throw ClientError("the twin did not answer in time; is its loop running?");
    }
  }
  std::string next_request() { return fmt::format("request-{}", ++requests); }

  ClientOptions options;
  asio::io_context io{1};
  websocket::stream<beast::tcp_stream> socket{io};
  beast::flat_buffer buffer;
  bool open = false, graph_known = false;
  std::string why_closed = "the twin has ended", name;

  std::map<std::uint32_t, foxglove::Channel> offers;
  std::map<std::string, std::uint32_t> service_ids;
  std::map<std::string, bool> wanted;  // subscribed topics, and whether the server was sent the subscription
  std::vector<std::string> late_subscriptions;
  std::map<std::pair<std::string, std::string>, std::uint32_t> advertised;
  std::vector<std::string> errors;
  std::vector<foxglove::Parameter> parameters;
  std::string answered_request;
  std::uint32_t requests = 0;
};

WebSocketClient::WebSocketClient(ClientOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
WebSocketClient::~WebSocketClient() = default;

const std::string& WebSocketClient::server_name() const {
  return impl_->name;
}
ReceiveBuffer& WebSocketClient::buffer() const {
  return *impl_;
}
void WebSocketClient::warn(const std::string& text) const {
  if (impl_->options.on_status) impl_->options.on_status(text);
}

std::vector<std::string> WebSocketClient::nodes() {
  std::set<std::string> names;
  for (const auto& [name, topic] : impl_->topics) {
    names.insert(topic.publishers.begin(), topic.publishers.end());
    names.insert(topic.subscribers.begin(), topic.subscribers.end());
  }
  for (const auto& [name, service] : impl_->services)
    names.insert(service.providers.begin(), service.providers.end());
  for (const NamedParameter& parameter : parameters()) names.insert(parameter.node);
  return {names.begin(), names.end()};
}

const TypeSupport& WebSocketClient::message_type(const std::string& topic) {
  const std::string& type = find_topic(topic).type;
  if (type.empty()) throw ClientError(fmt::format("nothing has been published on {} yet", topic));
  if (const TypeSupport* known = find_type(type)) return *known;
  throw ClientError(fmt::format("{} is a {}, a type unknown to doppel", topic, type));
}

void WebSocketClient::subscribe(const std::string& topic) {
  static_cast<void>(find_topic(topic));
  impl_->wanted[topic] = true;
  impl_->subscribe_now(topic);
}

void WebSocketClient::unsubscribe(const std::string& topic) {
  if (impl_->wanted.erase(topic) == 0) return;
  for (const auto& [id, offer] : impl_->offers) {
    if (offer.topic == topic) return impl_->send(foxglove::to_frame(foxglove::Unsubscribe{{id}}));
  }
}

bool WebSocketClient::wait_until(const std::function<bool()>& condition, Clock::time_point until) {
  while (true) {
    const bool held = impl_->wait([&] { return condition() || !impl_->late_subscriptions.empty(); }, until);
    for (const std::string& topic : std::exchange(impl_->late_subscriptions, {})) impl_->subscribe_now(topic);
    if (!held || condition()) return held;
  }
}

void WebSocketClient::publish(const std::string& topic, const std::string& type,
                              std::span<const std::byte> cdr) {
  const auto next = static_cast<std::uint32_t>(impl_->advertised.size() + 1);
  const auto [entry, is_new] = impl_->advertised.try_emplace({topic, type}, next);
  if (is_new) {
    impl_->send(foxglove::to_frame(
        foxglove::Advertise{{{.id = next, .topic = topic, .encoding = "cdr", .schema_name = type}}}));
  }
  impl_->send(foxglove::to_frame(foxglove::ClientData{entry->second, cdr}));
}

void WebSocketClient::sync() {
  const std::string id = impl_->next_request();
  impl_->send(
      foxglove::to_frame(foxglove::GetParameters{{""}, id}));  // the loop responds after all earlier messages
  impl_->await_request(id);
  if (impl_->errors.empty()) return;
  throw ClientError(std::exchange(impl_->errors, {}).front());
}

std::uint32_t WebSocketClient::begin_call(const std::string& service, std::span<const std::byte> request) {
  const auto found = impl_->service_ids.find(service);
  if (found == impl_->service_ids.end()) {
    std::vector<std::string> names;
    for (const auto& [name, id] : impl_->service_ids) names.push_back(name);
    throw ClientError(fmt::format("there is no service {}{}", service, did_you_mean(service, names)));
  }
  const std::uint32_t call = ++impl_->calls;
  impl_->send(foxglove::to_frame(foxglove::ServiceCall{found->second, call, "cdr", request}));
  return call;
}

std::vector<NamedParameter> WebSocketClient::parameters() {
  const std::string id = impl_->next_request();
  impl_->send(foxglove::to_frame(foxglove::GetParameters{{}, id}));
  impl_->await_request(id);
  std::vector<NamedParameter> out;
  for (foxglove::Parameter& parameter : impl_->parameters) {
    NamedParameter named{.node = "", .name = "", .value = std::move(parameter.value)};
    if (foxglove::split_parameter_name(parameter.name, named.node, named.name))
      out.push_back(std::move(named));
  }
  return out;
}

std::vector<NamedParameter> WebSocketClient::parameters(const std::string& node) {
  std::vector<NamedParameter> all = parameters();
  std::erase_if(all, [&](const NamedParameter& parameter) { return parameter.node != node; });
  return all;
}

Status WebSocketClient::set_parameter(const std::string& node, const std::string& name,
                                      const ParameterValue& value) {
  impl_->errors.clear();
  const std::string id = impl_->next_request();
  impl_->send(
      foxglove::to_frame(foxglove::SetParameters{{{foxglove::parameter_name(node, name), value}}, id}));
  impl_->await_request(id);
  if (impl_->errors.empty()) return {};
  return Status::refused(std::exchange(impl_->errors, {}).front());
}

}  // namespace doppel
