#include "doppel/ros/network/detail/bridge_services.h"

#include <algorithm>

#include "doppel/ros/network/bridge_types.h"

namespace doppel::ros2 {
namespace {

constexpr std::size_t kMaxCalls = 64;  // of one service, unanswered: more wait in DDS' history
// The longest waits of a response for its client's reader: until it is matched, and then until it is in step.
constexpr std::chrono::milliseconds kMatchTimeout{2000}, kInStepTimeout{20};

}  // namespace

bool BridgedServices::follow(const std::vector<ServiceInfo>& infos, SteadyTime now) {
  bool waits = false;
  for (auto& [key, served] : services_) served.seen = false;
  for (const ServiceInfo& info : infos) {
    Served& served = services_[{info.name, info.type, info.node}];
    served.seen = true;
    served.gone_since = {};
    if (served.server != nullptr) continue;
    waits = !unbridged_.attempt(info.name, [&] {
      served.server = std::make_shared<ServiceServer>(participant_, service_spec(info.name, info.type));
    }) || waits;
  }
  for (auto& [key, served] : services_) {
    if (!served.seen && served.gone_since == SteadyTime{}) served.gone_since = now;
    waits = waits || !served.seen;
  }
  std::erase_if(services_, [now](const auto& entry) {
    return !entry.second.seen && now - entry.second.gone_since >= kGracePeriod;
  });
  return waits;
}

// The response arrives on the loop's thread and is passed back to this one.
void BridgedServices::call(const Key& key, Served& served) {
  ++status_.requests;
  ++*served.calls;
  const auto here = [this, alive = std::weak_ptr(alive_), key, to = request_.related](const Status& status,
                                                                                      Bytes response) {
    if (alive.expired()) return;
    const auto found = services_.find(key);
    if (found != services_.end()) {
      finish(key, found->second, to, status, std::move(response));
    } else {
      ++status_.unanswered;
    }
  };
  edge_.call_from(
      {request_.related.writer.bytes, request_.related.sequence}, key.name, request_.cdr,
      [here, post_to_bridge = post_to_bridge_, share = calls_.share(request_.cdr.size())](
          Status status, Bytes response) mutable {
        post_to_bridge([here, share = std::move(share), status = std::move(status),
                        response = std::move(response)]() mutable { here(status, std::move(response)); });
      });
}

void BridgedServices::finish(const Key& key, const Served& served, const SampleIdentity& to,
                             const Status& status, Bytes response) {
  if (*served.calls > 0) --*served.calls;
  if (!status) return rejections_.add(key.name, to.writer, status.why());
  const auto now = std::chrono::steady_clock::now();
  Answer answer{served.server, to, std::move(response), now, nullptr};
  if (respond(answer, now)) return;
  if (answers_.is_full()) {
    ++status_.unanswered;
    return;
  }
  answer.share = answers_.share(answer.cdr.size());
  waiting_.push_back(std::move(answer));
}

// True: the response was sent or dropped.
bool BridgedServices::respond(const Answer& answer, SteadyTime now) {
  using Sent = ServiceServer::Sent;
  const auto server = answer.server.lock();
  const auto waited = now - answer.made;
  const auto when = waited < kInStepTimeout ? ServiceServer::When::in_step : ServiceServer::When::matched;
  const auto sent = server == nullptr ? Sent::client_gone : server->respond(answer.to, answer.cdr, when);
  if (sent == Sent::not_yet_in_step || (sent == Sent::not_yet_matched && waited < kMatchTimeout))
    return false;
  if (sent != Sent::yes) ++status_.unanswered;
  return true;
}

bool BridgedServices::retry(SteadyTime now) {
  std::erase_if(waiting_, [&](const Answer& answer) { return respond(answer, now); });
  return !waiting_.empty();
}

bool BridgedServices::take() {
  bool more = false;
  for (auto& [key, served] : services_) {
    if (served.server == nullptr || !served.server->requests().is_ready()) continue;
    const auto is_held_back = [this, &calls = *served.calls] {
      return calls >= kMaxCalls || calls_.is_full();
    };
    while (!is_held_back() && served.server->take(request_)) call(key, served);
    more = more || !is_held_back();
  }
  return more;
}

void BridgedServices::announce(Announcement& announcement) const {
  for (const auto& [key, served] : services_) {
    if (served.server == nullptr) continue;
    announcement.add_reader(key.node, served.server->requests().gid());
    announcement.add_writer(key.node, served.server->replies().gid());
  }
}

void ClientCore::reply(std::uint64_t call, Bytes response) {
  RemoteService::Reply wanted;
  {
    const std::lock_guard lock(mutex);
    const auto found = replies.find(call);
    if (found == replies.end()) return;
    wanted = std::move(found->second);
    replies.erase(found);
  }
  wanted(std::move(response));
}

void BridgedClients::set_participant(Participant* participant) {
  participant_ = participant;
  for (auto& [core, client] : clients_) {
    client = {};
    connect(*core, client);
  }
  match();
  changed_ = true;
}

void BridgedClients::connect(ClientCore& core, Client& client) {
  if (participant_ == nullptr) return;
  unbridged_.attempt(core.service.name,
                     [&] { client.client = std::make_unique<ServiceClient>(*participant_, core.service); });
}

void BridgedClients::follow(const std::vector<ServiceInfo>& services) {
  local_.clear();
  for (const ServiceInfo& service : services) local_.insert(service.name);
  match();
}

void BridgedClients::add(std::shared_ptr<ClientCore> core) {
  Client client;
  connect(*core, client);
  clients_.emplace(std::move(core), std::move(client));
  changed_ = true;
  match();
}

void BridgedClients::remove(const std::shared_ptr<ClientCore>& core) {
  core->available = false;
  changed_ = clients_.erase(core) > 0 || changed_;
}

void BridgedClients::call(const std::shared_ptr<ClientCore>& core, std::uint64_t number, Bytes request) {
  if (local_.contains(core->service.name)) {
    edge_.call(core->service.name, request,
               [weak = std::weak_ptr(core), number](const Status& status, Bytes response) {
                 const auto alive = weak.lock();
                 if (alive != nullptr && status) alive->reply(number, std::move(response));
               });
    return;
  }
  const auto found = clients_.find(core);
  if (found == clients_.end() || found->second.client == nullptr) return;
  Client& client = found->second;
  {
    // Requests that are no longer awaited are not kept.
    const std::lock_guard lock(core->mutex);
    std::erase_if(client.sent, [&core](const auto& sent) { return !core->replies.contains(sent.second); });
  }
  if (const auto sequence = client.client->send(request)) client.sent[*sequence] = number;
}

bool BridgedClients::take() {
  for (auto& [core, client] : clients_) {
    if (client.client == nullptr || !client.client->replies().is_ready()) continue;
    while (!backlog_.is_full() && client.client->take(reply_)) {
      const auto found = client.sent.find(reply_.related.sequence);
      if (found == client.sent.end()) continue;
      ++status_.received;
      bus_.post([weak = std::weak_ptr(core), number = found->second, bytes = reply_.cdr,
                 share = backlog_.share(reply_.cdr.size())] {
        share->end();
        if (const auto alive = weak.lock()) alive->reply(number, bytes);
      });
      client.sent.erase(found);
    }
    if (backlog_.is_full()) return true;
  }
  return false;
}

void BridgedClients::match() {
  for (auto& [core, client] : clients_) {
    core->available =
        local_.contains(core->service.name) || (client.client != nullptr && client.client->is_available());
  }
}

void BridgedClients::announce(Announcement& announcement) const {
  for (const auto& [core, client] : clients_) {
    if (client.client == nullptr) continue;
    announcement.add_writer(core->node, client.client->requests().gid());
    announcement.add_reader(core->node, client.client->replies().gid());
  }
}

}  // namespace doppel::ros2
