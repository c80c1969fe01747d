#include "doppel/ros/foxglove/foxglove_protocol.h"

#include <fmt/format.h>

#include "doppel/ros/foxglove/detail/foxglove_wire.h"

// The server's half: writes its messages as frames, and reads frames of clients.

namespace doppel::foxglove {
namespace {

using wire::json;
using wire::Malformed;

enum ServerOpcode : std::uint8_t {
  kMessageData = 1,
  kTime = 2,
  kServiceResponse = 3,
  kAssetResponse = 4,
  kPlaybackState = 5
};
enum AssetStatus : std::uint8_t { kAssetFound = 0, kAssetRefused = 1 };
enum ClientOpcode : std::uint8_t { kClientData = kClientDataOpcode, kServiceCall = 2 };

json schema_object(const std::string& type, const char* part, const std::string& schema) {
  return {{"encoding", kCdr}, {"schemaName", type + part}, {"schemaEncoding", kRos2Msg}, {"schema", schema}};
}

json named_ids(const std::vector<NamedIds>& entries, const char* ids_key) {
  json out = json::array();
  for (const NamedIds& entry : entries) out.push_back({{"name", entry.name}, {ids_key, entry.ids}});
  return out;
}

Subscribe read_subscribe(const json& object) {
  Subscribe out;
  for (const json& entry : wire::list(object, "subscriptions")) {
    out.items.push_back({.id = wire::id_of(entry, "id"), .channel = wire::id_of(entry, "channelId")});
  }
  return out;
}

Advertise read_advertise(const json& object) {
  Advertise out;
  for (const json& entry : wire::list(object, "channels")) {
    out.channels.push_back({.id = wire::id_of(entry, "id"),
                            .topic = wire::text(entry, "topic"),
                            .encoding = wire::text(entry, "encoding"),
                            .schema_name = wire::text(entry, "schemaName")});
  }
  return out;
}

std::vector<std::string> optional_texts(const json& object, const char* name) {
  return object.contains(name) ? wire::texts(object, name) : std::vector<std::string>{};
}

ClientMessage read_client_operation(const json& object, std::string op) {
  if (op == "subscribe") return read_subscribe(object);
  if (op == "unsubscribe") return Unsubscribe{wire::ids(object, "subscriptionIds")};
  if (op == "advertise") return read_advertise(object);
  if (op == "unadvertise") return Unadvertise{wire::ids(object, "channelIds")};
  if (op == "getParameters") {
    return GetParameters{optional_texts(object, "parameterNames"), wire::text_or(object, "id", "")};
  }
  if (op == "setParameters") {
    return SetParameters{wire::parameters_from_json(object), wire::text_or(object, "id", "")};
  }
  if (op == "subscribeParameterUpdates")
    return WatchParameters{true, optional_texts(object, "parameterNames")};
  if (op == "unsubscribeParameterUpdates")
    return WatchParameters{false, optional_texts(object, "parameterNames")};
  if (op == "subscribeConnectionGraph") return WatchGraph{true};
  if (op == "unsubscribeConnectionGraph") return WatchGraph{false};
  if (op == "fetchAsset") return FetchAsset{wire::id_of(object, "requestId"), wire::text(object, "uri")};
  return UnknownOperation{std::move(op)};
}

json time_object(Time time) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  return {{"sec", nanoseconds_of(time) / kSecond}, {"nsec", nanoseconds_of(time) % kSecond}};
}

}  // namespace

std::string to_frame(const ServerInfo& info) {
  json metadata = {{"ROS_DISTRO", info.distro}};
  for (const auto& [name, value] : info.metadata) metadata[name] = value;
  json object = {{"op", "serverInfo"},
                 {"name", info.name},
                 {"capabilities", info.capabilities},
                 {"supportedEncodings", info.encodings},
                 {"metadata", std::move(metadata)},
                 {"sessionId", info.session_id}};
  if (info.data_range) {
    object["dataStartTime"] = time_object(info.data_range->first);
    object["dataEndTime"] = time_object(info.data_range->second);
  }
  return wire::dump(object);
}

FrameBytes to_frame(const PlaybackState& state) {
  return wire::Writer(kPlaybackState, 20 + state.request.size())
      .number(static_cast<std::uint8_t>(state.status))
      .number(static_cast<std::uint64_t>(nanoseconds_of(state.now)))
      .number(state.speed)
      .number(static_cast<std::uint8_t>(state.did_seek ? 1 : 0))
      .text(state.request)
      .done();
}

std::string to_frame(const StatusMessage& status) {
  return wire::dump(
      {{"op", "status"}, {"level", static_cast<std::uint8_t>(status.level)}, {"message", status.message}});
}

std::string to_frame(const Channels& channels) {
  json list = json::array();
  for (const Channel& channel : channels.channels) {
    list.push_back({{"id", channel.id},
                    {"topic", channel.topic},
                    {"encoding", kCdr},
                    {"schemaName", channel.schema_name},
                    {"schemaEncoding", kRos2Msg},
                    {"schema", channel.schema}});
  }
  return wire::dump({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string to_frame(const RemovedChannels& removed) {
  return wire::ids_frame("unadvertise", "channelIds", removed.ids);
}

std::string to_frame(const Services& services) {
  json list = json::array();
  for (const ServiceOffer& service : services.services) {
    list.push_back({{"id", service.id},
                    {"name", service.name},
                    {"type", service.type},
                    {"request", schema_object(service.type, "_Request", service.request_schema)},
                    {"response", schema_object(service.type, "_Response", service.response_schema)}});
  }
  return wire::dump({{"op", "advertiseServices"}, {"services", std::move(list)}});
}

std::string to_frame(const RemovedServices& removed) {
  return wire::ids_frame("unadvertiseServices", "serviceIds", removed.ids);
}

std::string to_frame(const ParameterValues& values) {
  json frame{{"op", "parameterValues"}, {"parameters", wire::parameters_to_json(values.parameters)}};
  if (!values.id.empty()) frame["id"] = values.id;
  return wire::dump(frame);
}

std::string with_id(const std::string& frame, const std::string& id) {
  return id.empty() ? frame : "{\"id\":" + wire::dump(id) + "," + frame.substr(1);
}

std::string to_frame(const GraphUpdate& update) {
  return wire::dump({{"op", "connectionGraphUpdate"},
                     {"publishedTopics", named_ids(update.published, "publisherIds")},
                     {"subscribedTopics", named_ids(update.subscribed, "subscriberIds")},
                     {"advertisedServices", named_ids(update.services, "providerIds")},
                     {"removedTopics", update.removed_topics},
                     {"removedServices", update.removed_services}});
}

std::string to_frame(const ServiceFailure& failure) {
  return wire::dump({{"op", "serviceCallFailure"},
                     {"serviceId", failure.service},
                     {"callId", failure.call},
                     {"message", failure.message}});
}

FrameBytes to_frame(const TimeMessage& time) {
  return wire::Writer(kTime, 9).number(static_cast<std::uint64_t>(nanoseconds_of(time.now))).done();
}

FrameBytes to_frame(const ServiceResponse& response) {
  return wire::Writer(kServiceResponse, 13 + response.encoding.size() + response.payload.size())
      .number(response.service)
      .number(response.call)
      .text(response.encoding)
      .raw(response.payload)
      .done();
}

FrameBytes to_frame(const AssetFailure& failure) {
  return wire::Writer(kAssetResponse, kAssetHeadSize + failure.why.size())
      .number(failure.request)
      .number(std::uint8_t{kAssetRefused})
      .text(failure.why)
      .done();
}

std::array<std::byte, kAssetHeadSize> asset_head(std::uint32_t request) {
  std::array<std::byte, kAssetHeadSize> head{std::byte{kAssetResponse}};
  std::memcpy(head.data() + 1, &request, sizeof(request));
  head[5] = std::byte{kAssetFound};  // then the length of the error text: 0
  return head;
}

std::array<std::byte, kDataHeadSize> data_head(std::uint32_t subscription, Time stamp) {
  std::array<std::byte, kDataHeadSize> head{std::byte{kMessageData}};
  const auto nanoseconds = static_cast<std::uint64_t>(nanoseconds_of(stamp));
  std::memcpy(head.data() + 1, &subscription, sizeof(subscription));
  std::memcpy(head.data() + 5, &nanoseconds, sizeof(nanoseconds));
  return head;
}

Status read_client_text(std::string_view frame, ClientMessage& out) try {
  std::string op;
  const json object = wire::parse_object(frame, op);
  out = read_client_operation(object, op);
  return {};
} catch (const Malformed& problem) {
  return Status::refused(problem.what());
}

Status read_client_binary(ByteView frame, ClientMessage& out) try {
  wire::Reader reader(frame);
  const auto opcode = reader.number<std::uint8_t>();
  if (opcode == kClientData) {
    ClientData data{.channel = reader.number<std::uint32_t>(), .payload = {}};
    data.payload = reader.rest();
    out = data;
  } else if (opcode == kServiceCall) {
    ServiceCall call;
    call.service = reader.number<std::uint32_t>();
    call.call = reader.number<std::uint32_t>();
    call.encoding = reader.text();
    call.payload = reader.rest();
    out = std::move(call);
  } else {
    out = UnknownOperation{fmt::format("binary {}", opcode)};
  }
  return {};
} catch (const Malformed& problem) {
  return Status::refused(problem.what());
}

Status read_playback_request(ByteView frame, PlaybackRequest& out) try {
  wire::Reader reader(frame);
  if (reader.number<std::uint8_t>() != kPlaybackRequestOpcode)
    return Status::refused("it is no playback request");
  out.play = reader.number<std::uint8_t>() == 0;
  out.speed = reader.number<float>();
  const bool has_seek = reader.number<std::uint8_t>() != 0;
  const auto time = static_cast<std::int64_t>(reader.number<std::uint64_t>());
  out.seek = has_seek ? std::optional(time_from_nanoseconds(time)) : std::nullopt;
  out.id = reader.text();
  return {};
} catch (const Malformed& problem) {
  return Status::refused(problem.what());
}

}  // namespace doppel::foxglove
