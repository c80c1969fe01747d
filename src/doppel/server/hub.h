#pragma once
// What the server does, without its sockets: the clients of one twin, what each has subscribed to, advertised
// and asked for, and the bus behind them. Lives on the server's one thread.

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "doppel/bus/bus.h"
#include "doppel/export.h"
#include "doppel/foxglove/foxglove_protocol.h"
#include "doppel/server/asset_reader.h"

namespace doppel {

// One frame on its way to a client; the payload is shared between those who get it.
struct DOPPEL_API OutgoingFrame {
  // A message may be skipped for a client that does not keep up; an answer and a file may not.
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

// The hub's way to a client. send() never fails and never waits.
class DOPPEL_API ClientLink {
 public:
  virtual ~ClientLink() = default;
  virtual void send(OutgoingFrame frame) = 0;
  // Files that have been sent but are still waiting for those before them.
  [[nodiscard]] virtual std::size_t unsent_assets() const = 0;
};

struct HubOptions {
  std::string name;  // for serverInfo
  std::size_t ring_bytes = std::size_t{32} << 20;
  std::size_t max_calls = 256;            // of one client, unanswered
  std::size_t max_advertisements = 1024;  // of one client
  std::size_t max_fetches = 4096;         // of one client, unanswered
  std::shared_ptr<AssetLibrary> assets;   // what fetchAsset hands out; null: nothing
};

class DOPPEL_API Hub {
 public:
  using ClientId = std::uint64_t;
  // Runs a task on the server's thread, in order; callable from any thread, does nothing once the hub is
  // gone.
  using Post = std::function<void(std::function<void()>)>;

  Hub(Bus& bus, HubOptions options, Post post);
  ~Hub();
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  // Sends server info, channels and services. `link` has to live until leave().
  ClientId join(ClientLink& link);
  void leave(ClientId id);
  [[nodiscard]] std::size_t clients() const { return clients_.size(); }

  // Refused: the frame is none of the protocol, and the client should be closed with the reason. What is
  // well-formed but cannot be done is answered with a status message.
  Status on_text(ClientId id, std::string_view frame);
  Status on_binary(ClientId id, foxglove::ByteView frame);

  // Frames to this client are on their way: it may get more of the files that it asked for.
  void has_room(ClientId id);

  // Passes on what the bus has for the clients, `most` messages or less; true: there may be more.
  bool pump(std::size_t most);
  [[nodiscard]] int readable_fd() const { return edge_->readable_fd(); }
  // Ten times a second of wall time or so, while there are clients: the graph, the clock, watched parameters.
  void tick();

  [[nodiscard]] std::size_t topic_count() {
    refresh_offers();  // which else waits for clients
    return channels_.size();
  }

 private:
  // Hidden, as ROS 2 hides names with a leading underscore: in the graph its clients stand for it.
  static constexpr const char* kEdgeName = "/_websocket";

  struct Client {
    ClientLink* link = nullptr;
    std::string node;                                      // its name in the graph
    std::map<std::uint32_t, std::uint32_t> subscriptions;  // subscription to channel
    std::map<std::uint32_t, foxglove::ClientChannel> advertised;
    std::set<std::string> watched_parameters;
    bool watches_all_parameters = false, watches_graph = false;
    std::size_t calls = 0;
    std::deque<foxglove::FetchAsset> fetches;  // not begun
    bool fetching = false;
  };
  struct ChannelState {
    foxglove::Channel offer;
    bool latched = false, seen = false;
    std::vector<std::pair<ClientId, std::uint32_t>> subscribers;  // client, subscription
    std::shared_ptr<const Bytes> last;                            // of a latched topic
    Time last_stamp{};
  };
  struct ServiceState {
    foxglove::ServiceOffer offer;
    const ServiceSupport* support = nullptr;
    bool seen = false;
  };
  // Topic or service name to the names of those who have it.
  using Endpoints = std::map<std::string, std::vector<std::string>>;
  struct Graph {
    Endpoints published, subscribed, services;
  };

  // hub.cpp: what clients ask for
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
  void finish_call(ClientId id, const foxglove::ServiceCall& call, const Status& status,
                   const Bytes& response);
  Status dispatch(ClientId id, const foxglove::ClientMessage& message);
  void subscribe_one(Client& client, ClientId id, const foxglove::Subscribe::Item& item);
  void unsubscribe_one(Client& client, ClientId id, std::uint32_t subscription);
  void send_data(const ChannelState& channel, Client& client, std::uint32_t subscription, Time stamp,
                 const std::shared_ptr<const Bytes>& payload);
  static void say(Client& client, foxglove::StatusLevel level, std::string message);
  void send_parameters(ClientId id, std::vector<std::string> names, std::string request);

  // hub_assets.cpp: files
  void handle(Client& client, ClientId id, const foxglove::FetchAsset& fetch);
  void fetch_next(Client& client, ClientId id);
  void finish_fetch(ClientId id, std::uint32_t request, const AssetLibrary::Answer& answer);

  // hub_graph.cpp: what the bus offers
  void refresh_offers();
  void refresh_channels();
  void refresh_services();
  void refresh_graph();
  [[nodiscard]] Graph read_graph() const;
  void broadcast(std::string text);
  void follow_clock();
  void send_time();
  void poll_parameters();
  void report_parameters(const std::vector<NamedParameter>& now);

  Bus& bus_;
  HubOptions options_;
  Post post_;
  std::string session_id_;
  ClientId next_client_ = 1;
  std::map<ClientId, Client> clients_;
  std::map<std::uint32_t, ChannelState> channels_;  // by TopicId
  std::map<std::uint32_t, ServiceState> services_;  // by ServiceId
  OutgoingFrame channels_frame_, services_frame_;   // for those who join
  std::uint64_t seen_version_ = ~std::uint64_t{0};
  Graph graph_;                                       // as clients know it
  std::map<std::string, ParameterValue> parameters_;  // as watching clients know them
  std::uint32_t clock_ = 0;                           // the topic followed for the time, 0: none
  Time now_{}, time_sent_{-1};
  std::uint64_t ticks_ = 0;
  AssetReader assets_;
  std::unique_ptr<Edge> edge_;  // last: no reply runs once it is gone
};

}  // namespace doppel
