#include "doppel/ros/server/hub.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>

#include "doppel/ros/bus/twist_conversion.h"

namespace doppel {

using foxglove::StatusLevel;

namespace {

// From the bus, before clients are written to again: otherwise many large messages after a delay would
// overflow the queue of a client that is fast enough.
constexpr std::size_t kMaxBytesAtOnce = 16384;
// While the clients' messages fill the way from the bus faster than the clients read it, each client's
// share of it: a command still passes.
constexpr std::size_t kMaxMessagesPerTick = 8;
constexpr std::size_t kCongestedPart = 16;              // of the ring
constexpr std::size_t kMaxJson = std::size_t{1} << 20;  // bytes, of one payload

bool is_topic_name(std::string_view name) {
  const auto allowed = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '/'; };
  return name.size() > 1 && name.size() < 256 && name.front() == '/' && name.back() != '/' &&
         std::ranges::all_of(name, allowed);
}

std::string_view as_text(foxglove::ByteView bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// A payload in either encoding as CDR.
Status to_cdr_form(std::string_view encoding, const TypeSupport& type, foxglove::ByteView payload,
                   Bytes& out) {
  if (encoding == foxglove::kCdr) {
    out.assign(payload.begin(), payload.end());
    return {};
  }
  // The text is read on the thread that serves all clients.
  if (payload.size() > kMaxJson)
    return Status::refused(fmt::format("JSON of more than {} bytes; use cdr", kMaxJson));
  return type.json_to_cdr(payload.empty() ? "{}" : as_text(payload), out);
}

bool is_known_encoding(std::string_view encoding) {
  return encoding == foxglove::kCdr || encoding == foxglove::kJson;
}

}  // namespace

OutgoingFrame make_frame(std::string text) {
  auto owner = std::make_shared<const std::string>(std::move(text));
  OutgoingFrame frame{.text = true, .owner = owner, .body = {}};
  frame.body = std::as_bytes(std::span(*owner));
  return frame;
}

OutgoingFrame make_frame(foxglove::FrameBytes bytes) {
  auto owner = std::make_shared<const foxglove::FrameBytes>(std::move(bytes));
  OutgoingFrame frame{.owner = owner, .body = {}};
  frame.body = *owner;
  return frame;
}

Hub::Hub(Bus& bus, HubOptions options, Post post)
    : bus_(bus),
      options_(std::move(options)),
      post_(std::move(post)),
      session_id_(
          std::to_string(std::chrono::system_clock::now().time_since_epoch() / std::chrono::milliseconds(1))),
      assets_(options_.assets),
      edge_(bus.attach(kEdgeName, {.ring_bytes = options_.ring_bytes})) {
  if (options_.playback == nullptr) return;
  options_.playback->on_report([this, post = post_](const foxglove::PlaybackState& state) {
    post([this, state] { send_playback(state); });
  });
}

Hub::~Hub() {
  if (options_.playback != nullptr) options_.playback->on_report({});
}

void Hub::on_playback(ClientId id, foxglove::ByteView frame) {
  foxglove::PlaybackRequest request;
  const Status read = foxglove::read_playback_request(frame, request);
  if (!read) return reject(id, read);
  if (options_.playback == nullptr) return reject(id, Status::refused("no recording is played here"));
  options_.playback->request(std::move(request));
}

void Hub::send_playback(const foxglove::PlaybackState& state) {
  now_ = state.now;
  const OutgoingFrame frame = make_frame(foxglove::to_frame(state));
  for (auto& [id, client] : clients_) client.link->send(frame);
}

Hub::ClientId Hub::join(ClientLink& link) {
  // A client that joins gets the present offers at once; later changes are sent as differences.
  refresh_offers();
  foxglove::ServerInfo info{.name = options_.name,
                            .session_id = session_id_,
                            .capabilities = {"clientPublish", "services", "parameters", "parametersSubscribe",
                                             "connectionGraph", "time"},
                            .encodings = {std::string(foxglove::kCdr), std::string(foxglove::kJson)},
                            .distro = std::string(to_string(ros_distro())),
                            .metadata = options_.metadata};
  if (options_.playback != nullptr) {
    info.capabilities.emplace_back("playbackControl");
    info.data_range = options_.playback->range();
  }
  if (assets_.offers()) {
    info.capabilities.emplace_back("assets");
    info.metadata.emplace_back("files", "/files");  // where the page requests them over HTTP
  }
  link.send(make_frame(foxglove::to_frame(info)));
  link.send(channels_frame_);
  link.send(services_frame_);
  // Last, so that a client whose greeting throws is not kept.
  const ClientId id = next_client_++;
  Client client;
  client.link = &link;
  client.node = fmt::format("/_client_{}", id);
  client.lane = edge_->make_lane();
  clients_.emplace(id, std::move(client));
  return id;
}

void Hub::leave(ClientId id) {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return;
  while (!found->second.subscriptions.empty()) {
    unsubscribe_one(found->second, id, found->second.subscriptions.begin()->first);
  }
  const Client left = std::move(found->second);
  clients_.erase(found);
  edge_->act_for(left.lane);
  for (const auto& [channel_id, channel] : left.advertised) stop_publishing(channel.topic);
  edge_->act_for(nullptr);
  if (clients_.empty()) end_unused_subscriptions();  // there are no further ticks
}

bool Hub::is_ready(ClientId id, bool is_message) const {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return true;
  const Client& client = found->second;
  // A client whose requests the loop has not served yet is not read any further: TCP then slows the sender,
  // and no queue grows without bound.
  if (client.lane->pending() >= options_.max_unserved || client.reads >= options_.max_reads) return false;
  if (is_message && client.messages >= kMaxMessagesPerTick &&
      edge_->waiting_bytes() > options_.ring_bytes / kCongestedPart)
    return false;
  std::size_t bytes = 0;
  for (const auto& [other, each] : clients_) bytes += each.lane->pending_bytes();
  return bytes < options_.max_unserved_bytes;
}

void Hub::on_text(ClientId id, std::string_view frame) {
  foxglove::ClientMessage message;
  const Status read = foxglove::read_client_text(frame, message);
  return read ? dispatch(id, message) : reject(id, read);
}

void Hub::on_binary(ClientId id, foxglove::ByteView frame) {
  if (!frame.empty() && frame[0] == std::byte{foxglove::kPlaybackRequestOpcode})
    return on_playback(id, frame);
  foxglove::ClientMessage message;
  const Status read = foxglove::read_client_binary(frame, message);
  return read ? dispatch(id, message) : reject(id, read);
}

void Hub::reject(ClientId id, const Status& why) {
  const auto found = clients_.find(id);
  if (found != clients_.end())
    say(found->second, StatusLevel::error, fmt::format("frame rejected: {}", why.why()));
}

void Hub::dispatch(ClientId id, const foxglove::ClientMessage& message) {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return;
  edge_->act_for(found->second.lane);
  std::visit([&](const auto& operation) { handle(found->second, id, operation); }, message);
  edge_->act_for(nullptr);
}

void Hub::say(Client& client, StatusLevel level, std::string message) {
  client.link->send(make_frame(foxglove::to_frame(foxglove::StatusMessage{level, std::move(message)})));
}

void Hub::handle(Client& client, ClientId, const foxglove::UnknownOperation& unknown) {
  say(client, StatusLevel::error, fmt::format("unknown operation '{:.64}'", unknown.op));
}

void Hub::handle(Client& client, ClientId id, const foxglove::Subscribe& subscribe) {
  for (const auto& item : subscribe.items) subscribe_one(client, id, item);
  follow_clock();
}

void Hub::subscribe_one(Client& client, ClientId id, const foxglove::Subscribe::Item& item) {
  const auto found = channels_.find(item.channel);
  if (found == channels_.end()) {
    return say(client, StatusLevel::error,
               fmt::format("there is no channel {} to subscribe to", item.channel));
  }
  if (client.subscriptions.contains(item.id)) {
    return say(client, StatusLevel::error, fmt::format("the subscription id {} is in use", item.id));
  }
  ChannelState& channel = found->second;
  if (std::ranges::any_of(channel.subscribers, [id](const auto& s) { return s.first == id; })) {
    return say(client, StatusLevel::error,
               fmt::format("channel {} is already subscribed to", channel.offer.topic));
  }
  client.subscriptions[item.id] = item.channel;
  channel.subscribers.emplace_back(id, item.id);
  if (!channel.from_bus) {
    channel.waiting.insert(id);
    subscribe_on_bus(item.channel, channel);  // the bus then delivers what is latched
  } else if (channel.latched) {
    channel.waiting.insert(id);
    ask_for_latched(item.channel, channel);
  }
}

void Hub::handle(Client& client, ClientId id, const foxglove::Unsubscribe& unsubscribe) {
  for (const std::uint32_t subscription : unsubscribe.ids) {
    if (client.subscriptions.contains(subscription)) {
      unsubscribe_one(client, id, subscription);
    } else {
      say(client, StatusLevel::warning, fmt::format("there is no subscription {}", subscription));
    }
  }
}

void Hub::unsubscribe_one(Client& client, ClientId id, std::uint32_t subscription) {
  const std::uint32_t channel_id = client.subscriptions.at(subscription);
  client.subscriptions.erase(subscription);
  const auto found = channels_.find(channel_id);
  if (found == channels_.end()) return;
  std::erase_if(found->second.subscribers, [id](const auto& s) { return s.first == id; });
  found->second.waiting.erase(id);
  found->second.receiving.erase(id);
  follow_clock();
}

void Hub::handle(Client& client, ClientId, const foxglove::Advertise& advertise) {
  for (const foxglove::ClientChannel& wanted : advertise.channels) {
    foxglove::ClientChannel channel = wanted;
    if (!channel.topic.starts_with('/')) channel.topic = fmt::format("/{}", wanted.topic);
    const TypeSupport* type = find_type(channel.schema_name);
    const auto known =
        std::ranges::find_if(channels_, [&](const auto& c) { return c.second.offer.topic == channel.topic; });
    std::string why;
    if (client.advertised.contains(channel.id)) {
      why = fmt::format("the channel id {} is in use", channel.id);
    } else if (client.advertised.size() >= options_.max_advertisements) {
      why = fmt::format("the maximum of {} channels per client is reached", options_.max_advertisements);
    } else if (!is_topic_name(channel.topic)) {
      why = "this is not a valid topic name";
    } else if (!is_known_encoding(channel.encoding)) {
      why = fmt::format("the encoding '{:.64}' is not supported; use cdr or json", channel.encoding);
    } else if (type == nullptr) {
      why = fmt::format("unknown type '{:.256}'", channel.schema_name);
    } else if (known != channels_.end() && known->second.offer.schema_name != type->name &&
               !is_convertible_twist(type->name, known->second.offer.schema_name)) {  // the bus decides
      why = fmt::format("the topic has type {}, not {}", known->second.offer.schema_name, type->name);
    } else {
      channel.schema_name = type->name;
      client.advertised[channel.id] = std::move(channel);
      continue;
    }
    say(client, StatusLevel::error, fmt::format("cannot advertise {:.256}: {}", wanted.topic, why));
  }
}

void Hub::handle(Client& client, ClientId, const foxglove::Unadvertise& unadvertise) {
  for (const std::uint32_t channel : unadvertise.ids) {
    if (const auto found = client.advertised.extract(channel)) {
      stop_publishing(found.mapped().topic);
    } else {
      say(client, StatusLevel::warning, fmt::format("there is no client channel {}", channel));
    }
  }
}

void Hub::stop_publishing(const std::string& topic) {
  const auto uses = [&topic](const auto& channel) { return channel.second.topic == topic; };
  const auto publishes = [&uses](const auto& client) {
    return std::ranges::any_of(client.second.advertised, uses);
  };
  if (!published_.contains(topic) || std::ranges::any_of(clients_, publishes)) return;
  published_.erase(topic);
  edge_->unadvertise(kEdgeName, topic);
}

void Hub::handle(Client& client, ClientId, const foxglove::ClientData& data) {
  const auto found = client.advertised.find(data.channel);
  if (found == client.advertised.end()) {
    return say(client, StatusLevel::error, fmt::format("there is no client channel {}", data.channel));
  }
  const foxglove::ClientChannel& channel = found->second;
  ++client.messages;
  Bytes cdr;
  Status status = to_cdr_form(channel.encoding, *find_type(channel.schema_name), data.payload, cdr);
  if (status) status = edge_->publish(kEdgeName, channel.topic, channel.schema_name, cdr);
  if (status) published_.insert(channel.topic);
  if (!status)
    say(client, StatusLevel::error, fmt::format("{}: message rejected: {}", channel.topic, status.why()));
}

void Hub::handle(Client& client, ClientId id, const foxglove::ServiceCall& call) {
  const auto fail = [&](std::string why) {
    client.link->send(
        make_frame(foxglove::to_frame(foxglove::ServiceFailure{call.service, call.call, std::move(why)})));
  };
  const auto found = services_.find(call.service);
  if (found == services_.end()) return fail(fmt::format("there is no service {}", call.service));
  const ServiceState& service = found->second;
  if (client.calls >= options_.max_calls) return fail("too many calls are waiting for their responses");
  if (!is_known_encoding(call.encoding)) {
    return fail(fmt::format("the encoding '{:.64}' is not supported; use cdr or json", call.encoding));
  }
  Bytes request;
  if (const Status status = to_cdr_form(call.encoding, *service.support->request, call.payload, request);
      !status) {
    return fail(fmt::format("request for {} rejected: {}", service.offer.name, status.why()));
  }
  // The reply arrives on the loop's thread and is posted back to the server's, which alone may use the
  // client; it may have left meanwhile.
  ++client.calls;
  const foxglove::ServiceCall origin{call.service, call.call, call.encoding, {}};
  CallOrigin caller{.client = {}, .sequence = call.call};
  std::memcpy(caller.client.data(), &id, sizeof(id));
  edge_->call_from(caller, service.offer.name, request, [this, id, origin](Status status, Bytes response) {
    post_([this, id, origin, status = std::move(status), response = std::move(response)] {
      finish_call(id, origin, status, response);
    });
  });
}

void Hub::finish_call(ClientId id, const foxglove::ServiceCall& call, const Status& status,
                      const Bytes& response) {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return;
  Client& client = found->second;
  --client.calls;
  Status outcome = status;
  std::string json;
  if (outcome && call.encoding == foxglove::kJson) {
    const auto service = services_.find(call.service);
    outcome = service != services_.end() ? service->second.support->response->cdr_to_json(response, json)
                                         : Status::refused("the service no longer exists");
  }
  if (!outcome) {
    client.link->send(
        make_frame(foxglove::to_frame(foxglove::ServiceFailure{call.service, call.call, outcome.why()})));
    return;
  }
  const foxglove::ByteView payload =
      call.encoding == foxglove::kJson ? std::as_bytes(std::span(json)) : foxglove::ByteView(response);
  client.link->send(make_frame(
      foxglove::to_frame(foxglove::ServiceResponse{call.service, call.call, call.encoding, payload})));
}

void Hub::send_data(const ChannelState& channel, Client& client, std::uint32_t subscription, Time stamp,
                    const std::shared_ptr<const Bytes>& payload) {
  OutgoingFrame frame;
  if (!channel.latched)
    frame.kind = OutgoingFrame::Kind::message;  // a latched one is not sent again: not skipped
  frame.head = foxglove::data_head(subscription, stamp);
  frame.head_size = frame.head.size();
  frame.owner = payload;
  frame.body = *payload;
  client.link->send(std::move(frame));
}

bool Hub::pump(std::size_t most) {
  Edge::Incoming message;
  std::size_t passed = 0;
  for (std::size_t i = 0; i < most && passed < kMaxBytesAtOnce; ++i) {
    if (!edge_->next(message)) return false;
    now_ = message.latched == 0 ? message.stamp : std::max(now_, message.stamp);
    const auto found = channels_.find(message.topic);
    if (found == channels_.end()) continue;
    ChannelState& channel = found->second;
    if (channel.subscribers.empty()) continue;
    // One copy out of the ring, which all subscribers share.
    passed += message.cdr.size();
    const auto payload = std::make_shared<const Bytes>(message.cdr.begin(), message.cdr.end());
    // The numbers of a batch descend to 1; one that lost its end is followed by a larger number.
    if (message.latched != 0 && (channel.receiving.empty() || message.latched >= channel.left))
      channel.receiving.merge(channel.waiting);
    if (message.latched != 0) channel.left = message.latched;
    for (const auto& [id, subscription] : channel.subscribers) {
      if (message.latched == 0 || channel.receiving.contains(id))
        send_data(channel, clients_.at(id), subscription, message.stamp, payload);
    }
    if (message.latched == 1) channel.receiving.clear();
  }
  return true;
}

}  // namespace doppel
