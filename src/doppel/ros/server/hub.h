#pragma once
// The server without its sockets: the clients of one twin with their subscriptions, advertisements and
// requests, and the bus behind them. Used on the server's thread only, except where noted.

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/foxglove/foxglove_protocol.h"
#include "doppel/ros/server/asset_reader.h"
#include "doppel/ros/server/playback_control.h"

namespace doppel {

// One frame to a client; clients share the payload.
struct DOPPEL_API OutgoingFrame {
  // A message may be skipped for a client that does not keep up; a response or a file may not.
  enum class Kind : std::uint8_t { answer, message, asset };
  Kind kind = Kind::answer;
  bool text = false;
  std::size_t head_size = 0;
  std::array<std::byte, foxglove::kDataHeadSize> head{};
  std::shared_ptr<const void> owner;  // of the body
  std::span<const std::byte> body;

  [[nodiscard]] std::size_t size() const { return head_size + body.size(); }
};
DOPPEL_API OutgoingFrame make_frame(std::string text);
DOPPEL_API OutgoingFrame make_frame(foxglove::FrameBytes bytes);

// The hub's connection to a client. send() never fails and never waits.
class DOPPEL_API ClientLink {
 public:
  virtual ~ClientLink() = default;
  virtual void send(OutgoingFrame frame) = 0;
  // The number of files that are queued, but not yet written to the socket.
  [[nodiscard]] virtual std::size_t unsent_assets() const = 0;
};

struct HubOptions {
  std::string name;  // for serverInfo
  std::size_t ring_bytes = std::size_t{32} << 20;
  std::size_t max_calls = 256;            // of one client, unanswered: of services and for parameters
  std::size_t max_advertisements = 1024;  // of one client
  std::size_t max_fetches = 4096;         // of one client, unanswered
  // Beyond these, is_ready() is false: requests of one client that the loop has not served, answers to
  // reads of parameters that it has not got, and the bytes of all clients' requests that the loop has not
  // served.
  std::size_t max_unserved = 16, max_reads = 16, max_unserved_bytes = std::size_t{32} << 20;
  std::shared_ptr<AssetLibrary> assets;                         // the files of fetchAsset; nullptr: none
  std::vector<std::pair<std::string, std::string>> metadata{};  // for serverInfo
  std::shared_ptr<PlaybackControl> playback{};                  // nullptr: no recording is played
};

class DOPPEL_API Hub {
 public:
  using ClientId = std::uint64_t;
  // Runs a task on the server's thread, in order; callable from any thread, has no effect once the
  // hub is destroyed.
  using Post = std::function<void(std::function<void()>)>;

  Hub(Bus& bus, HubOptions options, Post post);
  ~Hub();
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  // Sends server info, channels and services. `link` must exist until leave().
  ClientId join(ClientLink& link);
  void leave(ClientId id);
  [[nodiscard]] std::size_t clients() const { return clients_.size(); }

  // True if the client's next frame is taken now. Otherwise the client is not read until it is, so that its
  // requests wait in its socket and not here; asked again after wake-ups of the bus and after tick().
  [[nodiscard]] bool is_ready(ClientId id, bool is_message) const;
  // Wakes readable_fd() when the loop has served requests.
  void wake_when_served(bool on) { edge_->wake_when_served(on); }

  // A frame that is not of the protocol, or cannot be fulfilled, gets a status message with the reason.
  void on_text(ClientId id, std::string_view frame);
  void on_binary(ClientId id, foxglove::ByteView frame);

  // Frames to this client were written: sends further requested files.
  void has_room(ClientId id);

  // Forwards at most `most` messages of the bus to the clients; true: there may be more.
  bool pump(std::size_t most);
  [[nodiscard]] int readable_fd() const { return edge_->readable_fd(); }
  // Called at about 10 Hz of wall-clock time while there are clients: graph, clock, watched parameters.
  void tick();

  [[nodiscard]] std::size_t topic_count() {
    refresh_offers();  // otherwise only done while there are clients
    return channels_.size();
  }

 private:
  // Hidden, as ROS 2 hides names with a leading underscore: the graph shows its clients instead.
  static constexpr const char* kEdgeName = "/_websocket";

  struct Client {
    ClientLink* link = nullptr;
    std::string node;                                      // its name in the graph
    std::map<std::uint32_t, std::uint32_t> subscriptions;  // subscription to channel
    std::map<std::uint32_t, foxglove::ClientChannel> advertised;
    std::set<std::string> watched_parameters;
    bool watches_all_parameters = false, watches_graph = false;
    bool waits_for_graph = false;
    std::size_t calls = 0, reads = 0;  // unanswered; each read is a call, too
    std::size_t messages = 0;          // since the last tick
    std::shared_ptr<Inbox::Lane> lane;
    std::deque<foxglove::FetchAsset> fetches;  // waiting
    bool fetching = false;
  };
  struct ChannelState {
    foxglove::Channel offer;
    bool latched = false, seen = false;
    bool from_bus = false;  // subscribed to; ends with a tick without subscribers
    std::vector<std::pair<ClientId, std::uint32_t>> subscribers;  // client, subscription
    // Subscribers that get the latched messages that the bus sends again: with its next batch, and with the
    // one whose first message has come.
    std::set<ClientId> waiting, receiving;
    std::uint32_t left = 0;  // of the batch, with its last message
    bool has_asked = false;  // the bus was asked for these since the last tick
    bool asks_at_tick = false;
  };
  struct ServiceState {
    foxglove::ServiceOffer offer;
    const ServiceSupport* support = nullptr;
    bool seen = false;
  };
  // From the name of a topic or service to the names of its nodes.
  using Endpoints = std::map<std::string, std::vector<std::string>>;
  struct Graph {
    Endpoints published, subscribed, services;
  };

  // hub.cpp: requests of clients
  void handle(Client& client, ClientId id, const foxglove::UnknownOperation& unknown);
  void handle(Client& client, ClientId id, const foxglove::Subscribe& subscribe);
  void handle(Client& client, ClientId id, const foxglove::Unsubscribe& unsubscribe);
  void handle(Client& client, ClientId id, const foxglove::Advertise& advertise);
  void handle(Client& client, ClientId id, const foxglove::Unadvertise& unadvertise);
  void handle(Client& client, ClientId id, const foxglove::ClientData& data);
  void handle(Client& client, ClientId id, const foxglove::ServiceCall& call);
  void handle(Client& client, ClientId id, const foxglove::GetParameters& get);
  void handle(Client& client, ClientId id, const foxglove::SetParameters& set);
  void handle(Client& client, ClientId id, const foxglove::WatchParameters& watch);
  void handle(Client& client, ClientId id, const foxglove::WatchGraph& watch);
  void on_playback(ClientId id, foxglove::ByteView frame);
  void send_playback(const foxglove::PlaybackState& state);
  void finish_call(ClientId id, const foxglove::ServiceCall& call, const Status& status,
                   const Bytes& response);
  void dispatch(ClientId id, const foxglove::ClientMessage& message);
  void reject(ClientId id, const Status& why);
  void subscribe_one(Client& client, ClientId id, const foxglove::Subscribe::Item& item);
  void unsubscribe_one(Client& client, ClientId id, std::uint32_t subscription);
  void send_data(const ChannelState& channel, Client& client, std::uint32_t subscription, Time stamp,
                 const std::shared_ptr<const Bytes>& payload);
  static void say(Client& client, foxglove::StatusLevel level, std::string message);
  void stop_publishing(const std::string& topic);

  // hub_parameters.cpp
  void send_parameters(Client& client, ClientId id, const std::vector<std::string>& names,
                       std::string request);
  void finish_read(ClientId id, const Edge::SharedParameters& values, const std::string& request, bool all);
  [[nodiscard]] OutgoingFrame frame_of_all(const Edge::SharedParameters& values, const std::string& request);

  // hub_assets.cpp: files
  void handle(Client& client, ClientId id, const foxglove::FetchAsset& fetch);
  void fetch_next(Client& client, ClientId id);
  void finish_fetch(ClientId id, std::uint32_t request, const AssetLibrary::Answer& answer);

  // hub_graph.cpp: the graph of the bus
  void refresh_offers();
  void refresh_channels();
  void refresh_services();
  void refresh_graph();
  void send_graph(Client& client);
  void subscribe_on_bus(std::uint32_t id, ChannelState& channel);
  void end_unused_subscriptions();
  void ask_for_latched(std::uint32_t id, ChannelState& channel);
  [[nodiscard]] Graph read_graph() const;
  void broadcast(std::string text);
  void follow_clock();
  void send_time();
  void poll_parameters();
  void report_parameters(const Edge::SharedParameters& now);

  Bus& bus_;
  HubOptions options_;
  Post post_;
  std::string session_id_;
  ClientId next_client_ = 1;
  std::map<ClientId, Client> clients_;
  std::map<std::uint32_t, ChannelState> channels_;  // by TopicId
  std::map<std::uint32_t, ServiceState> services_;  // by ServiceId
  OutgoingFrame channels_frame_, services_frame_;   // for new clients
  std::uint64_t seen_version_ = ~std::uint64_t{0};
  Graph graph_;                                       // as sent to clients
  OutgoingFrame graph_frame_;                         // all of it; empty: not made yet
  std::size_t graphs_ = 0;                            // compared with the bus since the last tick
  std::set<std::string> published_;                   // topics
  std::map<std::string, ParameterValue> parameters_;  // as sent to watching clients
  Edge::SharedParameters reported_;                   // the same
  bool polling_ = false, poll_again_ = false;
  Edge::SharedParameters framed_;                          // the values of the next two
  std::string all_parameters_;                             // a frame without a request's id
  std::map<std::string, OutgoingFrame> parameter_frames_;  // by the request's id
  std::uint32_t clock_ = 0;                                // the topic followed for the time, 0: none
  Time now_{}, time_sent_ = time_from_nanoseconds(-1);
  std::uint64_t ticks_ = 0;
  AssetReader assets_;
  std::unique_ptr<Edge> edge_;  // last, so that it is destroyed first and no reply runs afterwards
};

}  // namespace doppel
