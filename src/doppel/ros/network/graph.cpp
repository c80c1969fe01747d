#include "doppel/ros/network/graph.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <set>

#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/printable.h"
#include "doppel/ros/messages/rmw_dds_common.h"
#include "doppel/ros/network/names.h"

namespace doppel::ros2 {
namespace {

namespace msg = rmw_dds_common::msg;

constexpr const char* kTopic = "ros_discovery_info";  // not mangled
constexpr const char* kNoNode = "_CREATED_BY_BARE_DDS_APP_";
// A list may arrive before its participant is discovered, or be read after the participant has left; in the
// latter case it stays unknown.
constexpr std::chrono::seconds kFirstInfoTimeout{10};

EndpointSpec spec(History history) {
  EndpointSpec result{kTopic, dds_type(msg::ParticipantEntitiesInfo::kType),
                      type_support<msg::ParticipantEntitiesInfo>().hash(), latched_qos()};
  result.qos.history = history;
  return result;
}

// The GUID of the participant itself, from that of one of its endpoints.
Gid participant_of(const Gid& endpoint) {
  constexpr std::array<std::uint8_t, 4> kParticipantEntity{0, 0, 1, 0xc1};
  Gid gid = endpoint;
  std::copy(kParticipantEntity.begin(), kParticipantEntity.end(), gid.bytes.begin() + Gid::kPrefixSize);
  return gid;
}

std::vector<msg::Gid> to_message(const std::vector<Gid>& gids) {
  std::vector<msg::Gid> result;
  result.reserve(gids.size());
  for (const Gid& gid : gids) result.push_back({gid.bytes});
  return result;
}

std::vector<Gid> from_message(const std::vector<msg::Gid>& gids) {
  std::vector<Gid> result;
  result.reserve(gids.size());
  for (const msg::Gid& gid : gids) result.push_back({gid.data});
  return result;
}

msg::NodeEntitiesInfo to_message(const OwnNode& node) {
  const std::size_t slash = node.name.rfind('/');
  msg::NodeEntitiesInfo info;
  info.node_namespace = slash == 0 || slash == std::string::npos ? "/" : node.name.substr(0, slash);
  info.node_name = node.name.substr(slash == std::string::npos ? 0 : slash + 1);
  info.reader_gid_seq = to_message(node.readers);
  info.writer_gid_seq = to_message(node.writers);
  return info;
}

GraphNode from_message(const msg::NodeEntitiesInfo& info, const Gid& participant) {
  GraphNode node;
  node.name = info.node_namespace;
  if (!node.name.ends_with('/')) node.name += '/';
  node.name = printable(node.name + info.node_name);
  node.participant = participant;
  node.readers = from_message(info.reader_gid_seq);
  node.writers = from_message(info.writer_gid_seq);
  return node;
}

// "std_srvs/srv/Trigger" of "std_srvs/srv/Trigger_Request".
std::string service_type(std::string part) {
  for (const std::string_view suffix : {"_Request", "_Response"}) {
    if (!part.ends_with(suffix)) continue;
    part.resize(part.size() - suffix.size());
    break;
  }
  return part;
}

template <class Entry>
std::vector<Entry> sorted(std::map<std::string, Entry>&& by_name) {
  std::vector<Entry> result;
  result.reserve(by_name.size());
  for (auto& [name, entry] : by_name) {
    entry.name = name;
    result.push_back(std::move(entry));
  }
  return result;
}

}  // namespace

struct Graph::Impl {
  struct Claim {
    std::vector<GraphNode> nodes;
    bool was_there = false;  // its participant was discovered, so that its absence means that it has left
    std::chrono::steady_clock::time_point made = std::chrono::steady_clock::now();
  };

  Participant& participant;
  std::unique_ptr<Writer> writer;
  std::unique_ptr<Reader> reader;
  std::map<Gid, Claim> claims;  // by participant, the own one included
  Bytes announced;
  Sample sample;
  bool has_news = true;
  std::uint64_t version = 0;  // of discovery, when the lists were made
  std::vector<GraphNode> nodes;
  std::vector<GraphTopic> topics;
  std::vector<GraphService> services;

  explicit Impl(Participant& p)
      : participant(p),
        writer(p.make_writer(spec(History::keep_last))),
        reader(p.make_reader(spec(History::keep_all))) {
    claims[p.gid()];
  }

  void take();
  void erase_missing(const std::map<Gid, ParticipantInfo>& present);
  void list_nodes(const std::map<Gid, ParticipantInfo>& present);
  void list_endpoints(const std::map<Gid, ParticipantInfo>& present);
  [[nodiscard]] std::map<Gid, const std::string*> node_names() const;
};

// A participant can only announce its own endpoints; malformed lists are ignored.
void Graph::Impl::take() {
  while (reader->take(sample)) {
    msg::ParticipantEntitiesInfo info;
    if (!from_cdr(sample.cdr, info)) continue;
    const Gid gid = participant_of(sample.identity.writer);
    if (!std::ranges::equal(gid.prefix(), std::span(info.gid.data).first(Gid::kPrefixSize))) continue;
    Claim& claim = claims[gid];
    claim.nodes.clear();
    for (const msg::NodeEntitiesInfo& node : info.node_entities_info_seq)
      claim.nodes.push_back(from_message(node, gid));
    has_news = true;
  }
}

void Graph::Impl::erase_missing(const std::map<Gid, ParticipantInfo>& present) {
  const auto now = std::chrono::steady_clock::now();
  for (auto at = claims.begin(); at != claims.end();) {
    const bool is_there = present.contains(at->first);
    const bool has_gone = !is_there && (at->second.was_there || now - at->second.made > kFirstInfoTimeout);
    at->second.was_there |= is_there;
    at = has_gone ? claims.erase(at) : std::next(at);
  }
}

void Graph::Impl::list_nodes(const std::map<Gid, ParticipantInfo>& present) {
  nodes.clear();
  for (const auto& [gid, claim] : claims) {
    const auto info = present.find(gid);
    if (info == present.end()) continue;
    for (const GraphNode& node : claim.nodes) {
      nodes.push_back(node);
      nodes.back().enclave = info->second.enclave;
    }
  }
  std::stable_sort(nodes.begin(), nodes.end(),
                   [](const GraphNode& a, const GraphNode& b) { return a.name < b.name; });
}

std::map<Gid, const std::string*> Graph::Impl::node_names() const {
  std::map<Gid, const std::string*> names;
  for (const GraphNode& node : nodes)
    for (const auto* gids : {&node.readers, &node.writers})
      for (const Gid& gid : *gids) names.emplace(gid, &node.name);
  return names;
}

void Graph::Impl::list_endpoints(const std::map<Gid, ParticipantInfo>& present) {
  const auto names = node_names();
  std::map<std::string, GraphTopic> topics_by_name;
  std::map<std::string, GraphService> services_by_name;
  for (EndpointInfo& e : participant.endpoints()) {
    auto name = ros_name(e.topic);
    auto type = ros_type(e.type);
    if (!name || !type) continue;
    const auto node = names.find(e.gid);
    const auto owner = present.find(participant_of(e.gid));
    const bool is_ros = owner != present.end() && !owner->second.enclave.empty();
    GraphEndpoint endpoint{.node = node != names.end() ? *node->second
                                   : is_ros            ? kUnknownNode
                                                       : kNoNode,
                           .type = std::move(*type),
                           .type_hash = std::move(e.type_hash),
                           .qos = e.qos,
                           .gid = e.gid};
    if (name->kind == NameKind::topic) {
      GraphTopic& topic = topics_by_name[name->name];
      (e.is_writer ? topic.publishers : topic.subscriptions).push_back(std::move(endpoint));
    } else {
      endpoint.type = service_type(std::move(endpoint.type));
      GraphService& service = services_by_name[name->name];
      const bool is_reply = name->kind == NameKind::reply;
      auto& of_servers = is_reply ? service.reply_servers : service.servers;
      auto& of_clients = is_reply ? service.reply_clients : service.clients;
      (e.is_writer == is_reply ? of_servers : of_clients).push_back(std::move(endpoint));
    }
  }
  topics = sorted(std::move(topics_by_name));
  // Replies alone are left over from an end that is being removed.
  std::erase_if(services_by_name, [](const auto& entry) {
    return entry.second.servers.empty() && entry.second.clients.empty();
  });
  services = sorted(std::move(services_by_name));
}

Graph::Graph(Participant& participant) : impl_(std::make_unique<Impl>(participant)) {
  set_own_nodes({});
}

Graph::~Graph() = default;

void Graph::set_own_nodes(std::vector<OwnNode> nodes) {
  const Gid own = impl_->participant.gid();
  msg::ParticipantEntitiesInfo info;
  info.gid.data = own.bytes;
  for (const OwnNode& node : nodes) info.node_entities_info_seq.push_back(to_message(node));
  Bytes cdr = to_cdr(info);
  if (cdr == impl_->announced) return;
  impl_->writer->write(cdr);
  impl_->announced = std::move(cdr);
  std::vector<GraphNode>& claimed = impl_->claims[own].nodes;
  claimed.clear();
  for (const msg::NodeEntitiesInfo& node : info.node_entities_info_seq)
    claimed.push_back(from_message(node, own));
  impl_->has_news = true;
}

bool Graph::update() {
  if (impl_->reader->is_ready()) impl_->take();
  const std::uint64_t version = impl_->participant.discovery_version();
  if (!impl_->has_news && version == impl_->version) return false;
  impl_->has_news = false;
  impl_->version = version;
  std::map<Gid, ParticipantInfo> present;
  for (ParticipantInfo& p : impl_->participant.participants()) present.emplace(p.gid, std::move(p));
  impl_->erase_missing(present);
  impl_->list_nodes(present);
  impl_->list_endpoints(present);
  return true;
}

const std::vector<GraphNode>& Graph::nodes() const {
  return impl_->nodes;
}
const std::vector<GraphTopic>& Graph::topics() const {
  return impl_->topics;
}
const std::vector<GraphService>& Graph::services() const {
  return impl_->services;
}

}  // namespace doppel::ros2
