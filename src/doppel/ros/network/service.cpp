#include "doppel/ros/network/service.h"

#include "doppel/ros/network/names.h"

namespace doppel::ros2 {
namespace {

EndpointSpec request_spec(const ServiceSpec& spec) {
  return {dds_name(NameKind::request, spec.name), dds_type(spec.type + "_Request"), spec.request_hash,
          spec.qos, true};
}

EndpointSpec reply_spec(const ServiceSpec& spec) {
  return {dds_name(NameKind::reply, spec.name), dds_type(spec.type + "_Response"), spec.response_hash,
          spec.qos, true};
}

// The history of a server, as in rclcpp's parameter services (rmw_qos_profile_parameters): with the default
// of ten some requests of a burst would be lost, and their clients would wait without a response.
constexpr std::size_t kServerDepth = 1000;

EndpointSpec deep(EndpointSpec spec) {
  spec.qos.depth = kServerDepth;
  return spec;
}

// DDSI-RTPS 2.5, 9.3.1.2: the last byte is the kind of the endpoint.
bool is_reader(const Gid& gid) {
  return (gid.bytes.back() & 0x04) != 0;
}

}  // namespace

ServiceServer::ServiceServer(Participant& participant, const ServiceSpec& spec)
    : requests_(participant.make_reader(deep(request_spec(spec)))),
      replies_(participant.make_writer(deep(reply_spec(spec)))) {}

bool ServiceServer::take(Sample& request) {
  if (!requests_->take(request)) return false;
  const Gid client = request.identity.writer;
  const bool tells_reader = request.related.writer != Gid{};
  request.related = {tells_reader ? request.related.writer : client, request.identity.sequence};
  if (tells_reader) remember(request.related.writer, client);
  return true;
}

// One reply reader for each request writer, the last announced one, so that a peer with another one in every
// request cannot use unlimited memory.
void ServiceServer::remember(const Gid& reply_reader, const Gid& request_writer) {
  const auto known = clients_.find(reply_reader);
  if (known != clients_.end() && known->second == request_writer) return;
  std::erase_if(clients_, [&](const auto& client) {
    return client.second == request_writer || !requests_->is_matched(client.second);
  });
  clients_.insert_or_assign(reply_reader, request_writer);
}

ServiceServer::Sent ServiceServer::respond(const SampleIdentity& to, std::span<const std::byte> cdr,
                                           When when) {
  if (is_reader(to.writer) && !replies_->is_matched(to.writer)) {
    const auto client = clients_.find(to.writer);
    const bool is_there = client != clients_.end() && requests_->is_matched(client->second);
    return is_there ? Sent::not_yet_matched : Sent::client_gone;
  }
  if (when == When::in_step && is_reader(to.writer) && !replies_->is_in_step(to.writer))
    return Sent::not_yet_in_step;
  return replies_->write(cdr, &to) ? Sent::yes : Sent::not_yet_matched;
}

ServiceClient::ServiceClient(Participant& participant, const ServiceSpec& spec)
    : requests_(participant.make_writer(request_spec(spec))),
      replies_(participant.make_reader(reply_spec(spec))) {}

bool ServiceClient::is_available() const {
  const std::size_t servers = requests_->matched();
  return servers > 0 && servers == replies_->matched();
}

std::optional<std::int64_t> ServiceClient::send(std::span<const std::byte> cdr) {
  const SampleIdentity answer_to{replies_->gid(), 0};
  const auto sent = requests_->write(cdr, &answer_to);
  return sent ? std::optional(sent->sequence) : std::nullopt;
}

bool ServiceClient::take(Sample& reply) {
  while (replies_->take(reply))
    if (reply.related.writer == replies_->gid() || reply.related.writer == requests_->gid()) return true;
  return false;
}

}  // namespace doppel::ros2
