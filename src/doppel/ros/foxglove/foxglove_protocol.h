#pragma once
// The Foxglove WebSocket protocol, version 1 (github.com/foxglove/ws-protocol, docs/spec.md): its messages as
// plain structs, and their frames. Independent of sockets and threads. Times are nanoseconds, numbers in
// frames little endian.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/base/core/time.h"
#include "doppel/export.h"
#include "doppel/ros/bus/parameters.h"

namespace doppel::foxglove {

inline constexpr std::string_view kSubprotocol = "foxglove.websocket.v1";
inline constexpr std::string_view kSdkSubprotocol =
    "foxglove.sdk.v1";  // the same frames under their later name
inline constexpr std::string_view kCdr = "cdr", kJson = "json", kRos2Msg = "ros2msg";

using FrameBytes = std::vector<std::byte>;
using ByteView = std::span<const std::byte>;

// -- messages of the server

struct ServerInfo {
  std::string name, session_id;
  std::vector<std::string> capabilities, encodings;
  std::string distro{};  // ROS_DISTRO, by which viewers choose definitions of messages
  std::vector<std::pair<std::string, std::string>> metadata{};  // the rest; not read
  std::optional<std::pair<Time, Time>> data_range{};  // of a server that plays a recording: its start and end
};

enum class StatusLevel : std::uint8_t { info = 0, warning = 1, error = 2 };

struct StatusMessage {
  StatusLevel level = StatusLevel::info;
  std::string message;
};

struct Channel {
  std::uint32_t id = 0;
  std::string topic, schema_name, schema;  // encoding "cdr", schema in "ros2msg"
};
struct Channels {
  std::vector<Channel> channels;
};
struct RemovedChannels {
  std::vector<std::uint32_t> ids;
};

struct ServiceOffer {
  std::uint32_t id = 0;
  std::string name, type, request_schema, response_schema;
};
struct Services {
  std::vector<ServiceOffer> services;
};
struct RemovedServices {
  std::vector<std::uint32_t> ids;
};

struct Parameter {
  std::string name;      // "/node.parameter"
  ParameterValue value;  // monostate: not set
};
struct ParameterValues {
  std::vector<Parameter> parameters;
  std::string id;  // of the request; empty: not a response
};

struct NamedIds {
  std::string name;
  std::vector<std::string> ids;
};
struct GraphUpdate {
  std::vector<NamedIds> published, subscribed, services;  // each replaces the former entry of that name
  std::vector<std::string> removed_topics, removed_services;
};

struct ServiceFailure {
  std::uint32_t service = 0, call = 0;
  std::string message;
};
struct MessageData {
  std::uint32_t subscription = 0;
  Time stamp{};
  ByteView payload;
};
struct TimeMessage {
  Time now{};
};
struct ServiceResponse {
  std::uint32_t service = 0, call = 0;
  std::string encoding;
  ByteView payload;
};

struct AssetFailure {
  std::uint32_t request = 0;
  std::string why;
};
struct AssetData {
  std::uint32_t request = 0;
  ByteView data;
};

// A recording that is played (github.com/foxglove/foxglove-sdk, protocol v1).
struct PlaybackState {
  enum class Status : std::uint8_t { playing = 0, paused = 1, buffering = 2, ended = 3 };
  Status status = Status::paused;
  Time now{};
  float speed = 1;
  bool did_seek = false;  // a jump is the reason of this message
  std::string request;    // whose answer it is; empty: of none
};

DOPPEL_API std::string to_frame(const ServerInfo& info);
DOPPEL_API FrameBytes to_frame(const PlaybackState& state);
DOPPEL_API std::string to_frame(const StatusMessage& status);
DOPPEL_API std::string to_frame(const Channels& channels);
DOPPEL_API std::string to_frame(const RemovedChannels& removed);
DOPPEL_API std::string to_frame(const Services& services);
DOPPEL_API std::string to_frame(const RemovedServices& removed);
DOPPEL_API std::string to_frame(const ParameterValues& values);
// The frame of values without an id, with the id of a request: clients share the text of the values.
DOPPEL_API std::string with_id(const std::string& frame, const std::string& id);
DOPPEL_API std::string to_frame(const GraphUpdate& update);
DOPPEL_API std::string to_frame(const ServiceFailure& failure);
DOPPEL_API FrameBytes to_frame(const TimeMessage& time);
DOPPEL_API FrameBytes to_frame(const ServiceResponse& response);
DOPPEL_API FrameBytes to_frame(const AssetFailure& failure);
constexpr std::uint8_t kClientDataOpcode = 1;  // the first byte of a client's message
// The bytes before the payload, separate so that clients share one payload.
constexpr std::size_t kDataHeadSize = 13;
DOPPEL_API std::array<std::byte, kDataHeadSize> data_head(std::uint32_t subscription, Time stamp);
constexpr std::size_t kAssetHeadSize = 10;
DOPPEL_API std::array<std::byte, kAssetHeadSize> asset_head(std::uint32_t request);

using ServerMessage = std::variant<std::monostate, ServerInfo, StatusMessage, Channels, RemovedChannels,
                                   Services, RemovedServices, ParameterValues, GraphUpdate, ServiceFailure,
                                   MessageData, TimeMessage, ServiceResponse, AssetFailure, AssetData>;
// Refuse a malformed frame with the reason. monostate: well-formed, but of an unknown kind. Views point
// into the frame.
DOPPEL_API Status read_server_text(std::string_view frame, ServerMessage& out);
DOPPEL_API Status read_server_binary(ByteView frame, ServerMessage& out);

// -- messages of a client

struct Subscribe {
  struct Item {
    std::uint32_t id = 0, channel = 0;
  };
  std::vector<Item> items;
};
struct Unsubscribe {
  std::vector<std::uint32_t> ids;
};
struct ClientChannel {
  std::uint32_t id = 0;
  std::string topic, encoding, schema_name;
};
struct Advertise {
  std::vector<ClientChannel> channels;
};
struct Unadvertise {
  std::vector<std::uint32_t> ids;
};
struct GetParameters {
  std::vector<std::string> names;  // empty: all
  std::string id;
};
struct SetParameters {
  std::vector<Parameter> parameters;
  std::string id;  // empty: no response is requested
};
struct WatchParameters {
  bool on = true;
  std::vector<std::string> names;  // empty: all
};
struct WatchGraph {
  bool on = true;
};
struct FetchAsset {
  std::uint32_t request = 0;
  std::string uri;
};
struct ClientData {
  std::uint32_t channel = 0;
  ByteView payload;
};
struct ServiceCall {
  std::uint32_t service = 0, call = 0;
  std::string encoding;
  ByteView payload;
};
struct UnknownOperation {
  std::string op;
};

// A client that controls a recording sends a frame of its own kind, which begins with this byte.
constexpr std::uint8_t kPlaybackRequestOpcode = 3;
struct PlaybackRequest {
  bool play = true;  // false: pause
  float speed = 1;
  std::optional<Time> seek;
  std::string id;
};
DOPPEL_API Status read_playback_request(ByteView frame, PlaybackRequest& out);

using ClientMessage =
    std::variant<UnknownOperation, Subscribe, Unsubscribe, Advertise, Unadvertise, GetParameters,
                 SetParameters, WatchParameters, WatchGraph, FetchAsset, ClientData, ServiceCall>;
// Refuse a frame that is not one of this protocol. Views point into the frame.
DOPPEL_API Status read_client_text(std::string_view frame, ClientMessage& out);
DOPPEL_API Status read_client_binary(ByteView frame, ClientMessage& out);

DOPPEL_API std::string to_frame(const Subscribe& subscribe);
DOPPEL_API std::string to_frame(const Unsubscribe& unsubscribe);
DOPPEL_API std::string to_frame(const Advertise& advertise);
DOPPEL_API std::string to_frame(const GetParameters& get);
DOPPEL_API std::string to_frame(const SetParameters& set);
DOPPEL_API std::string to_frame(const WatchGraph& watch);
DOPPEL_API std::string to_frame(const FetchAsset& fetch);
DOPPEL_API FrameBytes to_frame(const ClientData& data);
DOPPEL_API FrameBytes to_frame(const ServiceCall& call);

}  // namespace doppel::foxglove
