#include "doppel/ros/foxglove/detail/foxglove_wire.h"

// The client's half: writes its messages as frames, and reads frames of a server.

namespace doppel::foxglove {
namespace {

using wire::json;
using wire::Malformed;

Channels read_channels(const json& object) {
  Channels out;
  for (const json& entry : wire::list(object, "channels")) {
    out.channels.push_back({.id = wire::id_of(entry, "id"),
                            .topic = wire::text(entry, "topic"),
                            .schema_name = wire::text(entry, "schemaName"),
                            .schema = wire::text(entry, "schema")});
  }
  return out;
}

std::string service_schema(const json& entry, const char* part, const char* old_name) {
  return entry.contains(part) ? wire::text(entry[part], "schema") : wire::text_or(entry, old_name, "");
}

Services read_services(const json& object) {
  Services out;
  for (const json& entry : wire::list(object, "services")) {
    out.services.push_back({.id = wire::id_of(entry, "id"),
                            .name = wire::text(entry, "name"),
                            .type = wire::text(entry, "type"),
                            .request_schema = service_schema(entry, "request", "requestSchema"),
                            .response_schema = service_schema(entry, "response", "responseSchema")});
  }
  return out;
}

std::vector<NamedIds> read_named_ids(const json& object, const char* name, const char* ids_key) {
  std::vector<NamedIds> out;
  for (const json& entry : wire::list(object, name)) {
    out.push_back({wire::text(entry, "name"), wire::texts(entry, ids_key)});
  }
  return out;
}

ServerInfo read_info(const json& object) {
  ServerInfo info;
  info.name = wire::text_or(object, "name", "");
  info.session_id = wire::text_or(object, "sessionId", "");
  info.capabilities = wire::texts(object, "capabilities");
  if (object.contains("metadata") && object["metadata"].is_object())
    info.distro = wire::text_or(object["metadata"], "ROS_DISTRO", "");
  if (object.contains("supportedEncodings")) info.encodings = wire::texts(object, "supportedEncodings");
  return info;
}

GraphUpdate read_graph(const json& object) {
  GraphUpdate out;
  out.published = read_named_ids(object, "publishedTopics", "publisherIds");
  out.subscribed = read_named_ids(object, "subscribedTopics", "subscriberIds");
  out.services = read_named_ids(object, "advertisedServices", "providerIds");
  out.removed_topics = wire::texts(object, "removedTopics");
  out.removed_services = wire::texts(object, "removedServices");
  return out;
}

ServerMessage read_server_operation(const json& object, const std::string& op) {
  if (op == "serverInfo") return read_info(object);
  if (op == "status") {
    const std::uint32_t level = wire::id_of(object, "level");
    if (level > 2) throw Malformed("a status has a level from 0 to 2");
    return StatusMessage{static_cast<StatusLevel>(level), wire::text(object, "message")};
  }
  if (op == "advertise") return read_channels(object);
  if (op == "unadvertise") return RemovedChannels{wire::ids(object, "channelIds")};
  if (op == "advertiseServices") return read_services(object);
  if (op == "unadvertiseServices") return RemovedServices{wire::ids(object, "serviceIds")};
  if (op == "parameterValues") {
    return ParameterValues{wire::parameters_from_json(object), wire::text_or(object, "id", "")};
  }
  if (op == "connectionGraphUpdate") return read_graph(object);
  if (op == "serviceCallFailure") {
    return ServiceFailure{wire::id_of(object, "serviceId"), wire::id_of(object, "callId"),
                          wire::text(object, "message")};
  }
  return std::monostate{};
}

}  // namespace

Status read_server_text(std::string_view frame, ServerMessage& out) try {
  std::string op;
  const json object = wire::parse_object(frame, op);
  out = read_server_operation(object, op);
  return {};
} catch (const Malformed& problem) {
  return Status::refused(problem.what());
}

Status read_server_binary(ByteView frame, ServerMessage& out) try {
  wire::Reader reader(frame);
  const auto opcode = reader.number<std::uint8_t>();
  if (opcode == 1) {
    MessageData data;
    data.subscription = reader.number<std::uint32_t>();
    data.stamp = time_from_nanoseconds(static_cast<std::int64_t>(reader.number<std::uint64_t>()));
    data.payload = reader.rest();
    out = data;
  } else if (opcode == 2) {
    out = TimeMessage{time_from_nanoseconds(static_cast<std::int64_t>(reader.number<std::uint64_t>()))};
  } else if (opcode == 3) {
    ServiceResponse response;
    response.service = reader.number<std::uint32_t>();
    response.call = reader.number<std::uint32_t>();
    response.encoding = reader.text();
    response.payload = reader.rest();
    out = std::move(response);
  } else if (opcode == 4) {
    const auto request = reader.number<std::uint32_t>();
    const bool found = reader.number<std::uint8_t>() == 0;
    std::string why = reader.text();
    if (found) {
      out = AssetData{request, reader.rest()};
    } else {
      out = AssetFailure{request, std::move(why)};
    }
  } else {
    out = std::monostate{};
  }
  return {};
} catch (const Malformed& problem) {
  return Status::refused(problem.what());
}

std::string to_frame(const Subscribe& subscribe) {
  json list = json::array();
  for (const Subscribe::Item& item : subscribe.items)
    list.push_back({{"id", item.id}, {"channelId", item.channel}});
  return wire::dump({{"op", "subscribe"}, {"subscriptions", std::move(list)}});
}

std::string to_frame(const Unsubscribe& unsubscribe) {
  return wire::ids_frame("unsubscribe", "subscriptionIds", unsubscribe.ids);
}

std::string to_frame(const Advertise& advertise) {
  json list = json::array();
  for (const ClientChannel& channel : advertise.channels) {
    list.push_back({{"id", channel.id},
                    {"topic", channel.topic},
                    {"encoding", channel.encoding},
                    {"schemaName", channel.schema_name}});
  }
  return wire::dump({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string to_frame(const GetParameters& get) {
  json frame{{"op", "getParameters"}, {"parameterNames", get.names}};
  if (!get.id.empty()) frame["id"] = get.id;
  return wire::dump(frame);
}

std::string to_frame(const SetParameters& set) {
  json frame{{"op", "setParameters"}, {"parameters", wire::parameters_to_json(set.parameters)}};
  if (!set.id.empty()) frame["id"] = set.id;
  return wire::dump(frame);
}

std::string to_frame(const WatchGraph& watch) {
  return wire::dump({{"op", watch.on ? "subscribeConnectionGraph" : "unsubscribeConnectionGraph"}});
}

std::string to_frame(const FetchAsset& fetch) {
  return wire::dump({{"op", "fetchAsset"}, {"uri", fetch.uri}, {"requestId", fetch.request}});
}

FrameBytes to_frame(const ClientData& data) {
  return wire::Writer(1, 5 + data.payload.size()).number(data.channel).raw(data.payload).done();
}

FrameBytes to_frame(const ServiceCall& call) {
  return wire::Writer(2, 13 + call.encoding.size() + call.payload.size())
      .number(call.service)
      .number(call.call)
      .text(call.encoding)
      .raw(call.payload)
      .done();
}

}  // namespace doppel::foxglove
