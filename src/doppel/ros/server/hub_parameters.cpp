#include <fmt/format.h>

#include <algorithm>

#include "doppel/ros/foxglove/parameter_name.h"
#include "doppel/ros/server/hub.h"

// Parameters in the Foxglove protocol. Equal requests for all parameters share one answer until a value
// changes.

namespace doppel {

using foxglove::StatusLevel;

namespace {

constexpr std::size_t kMaxRequestId = 1024, kMaxParameterName = 1024;  // bytes
constexpr std::size_t kMaxFrames = 64;                                 // answers that are kept to be shared

foxglove::ParameterValues named_values(const std::vector<NamedParameter>& values) {
  foxglove::ParameterValues out;
  for (const NamedParameter& parameter : values)
    out.parameters.push_back({foxglove::parameter_name(parameter.node, parameter.name), parameter.value});
  return out;
}

}  // namespace

void Hub::handle(Client& client, ClientId id, const foxglove::GetParameters& get) {
  send_parameters(client, id, get.names, get.id);
}

// The values are read after the client's earlier requests.
void Hub::send_parameters(Client& client, ClientId id, const std::vector<std::string>& names,
                          std::string request) {
  if (client.calls >= options_.max_calls)
    return say(client, StatusLevel::error, "too many calls are waiting for their responses");
  if (request.size() > kMaxRequestId) {
    return say(client, StatusLevel::error,
               fmt::format("the id of a request has at most {} bytes", kMaxRequestId));
  }
  ++client.calls;
  ++client.reads;
  const auto answer = [this, id, request = std::move(request),
                       all = names.empty()](const Edge::SharedParameters& values) {
    post_([this, id, request, all, values] { finish_read(id, values, request, all); });
  };
  if (names.empty()) return edge_->get_parameters(answer);
  std::vector<std::pair<std::string, std::string>> requested;
  for (const std::string& full : std::set<std::string>(names.begin(), names.end())) {
    std::string node, name;
    if (foxglove::split_parameter_name(full, node, name)) requested.emplace_back(node, name);
  }
  edge_->get_parameters(std::move(requested), answer);
}

void Hub::finish_read(ClientId id, const Edge::SharedParameters& values, const std::string& request,
                      bool all) {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return;
  Client& client = found->second;
  --client.calls;
  --client.reads;
  if (all) return client.link->send(frame_of_all(values, request));
  foxglove::ParameterValues answer = named_values(*values);
  answer.id = request;
  client.link->send(make_frame(foxglove::to_frame(answer)));
}

OutgoingFrame Hub::frame_of_all(const Edge::SharedParameters& values, const std::string& request) {
  if (framed_ != values) {
    framed_ = values;
    all_parameters_ = foxglove::to_frame(named_values(*values));
    parameter_frames_.clear();
  }
  if (const auto found = parameter_frames_.find(request); found != parameter_frames_.end())
    return found->second;
  if (parameter_frames_.size() >= kMaxFrames) parameter_frames_.clear();
  return parameter_frames_[request] = make_frame(foxglove::with_id(all_parameters_, request));
}

void Hub::handle(Client& client, ClientId id, const foxglove::SetParameters& set) {
  std::vector<std::string> names;
  for (const foxglove::Parameter& parameter : set.parameters) {
    std::string node, name;
    if (!foxglove::split_parameter_name(parameter.name, node, name)) {
      say(client, StatusLevel::error,
          fmt::format("'{:.256}' is not a parameter; names have the form /node.parameter", parameter.name));
      continue;
    }
    names.push_back(foxglove::parameter_name(node, name));
    if (std::holds_alternative<std::monostate>(parameter.value)) {
      say(client, StatusLevel::error, fmt::format("{:.256}: parameters cannot be removed", parameter.name));
      continue;
    }
    edge_->set_parameter(node, name, parameter.value, [this, id, full = names.back()](const Status& status) {
      if (status) return;
      post_([this, id, text = fmt::format("{}: {}", full, status.why())] {
        const auto found = clients_.find(id);
        if (found != clients_.end()) say(found->second, StatusLevel::error, text);
      });
    });
  }
  if (!set.id.empty())
    send_parameters(client, id, names.empty() ? std::vector<std::string>{""} : std::move(names), set.id);
  poll_parameters();
}

void Hub::handle(Client& client, ClientId, const foxglove::WatchParameters& watch) {
  if (watch.names.empty()) {
    client.watches_all_parameters = watch.on;
    if (!watch.on) client.watched_parameters.clear();
  }
  for (const std::string& name : watch.names) {
    if (!watch.on) {
      client.watched_parameters.erase(name);
    } else if (name.size() > kMaxParameterName) {
      say(client, StatusLevel::error, fmt::format("'{:.64}...' is not a parameter", name));
    } else if (client.watched_parameters.size() < options_.max_advertisements) {
      client.watched_parameters.insert(name);
    } else {
      return say(client, StatusLevel::error, "too many parameters are watched");
    }
  }
  poll_parameters();
}

// One request at a time: further ones are combined into the next tick's.
void Hub::poll_parameters() {
  poll_again_ = false;
  const bool watched = std::ranges::any_of(clients_, [](const auto& client) {
    return client.second.watches_all_parameters || !client.second.watched_parameters.empty();
  });
  if (!watched) {
    parameters_.clear();
    reported_ = nullptr;
    return;
  }
  if (polling_) {
    poll_again_ = true;
    return;
  }
  polling_ = true;
  edge_->get_parameters([this](const Edge::SharedParameters& all) {
    post_([this, all] {
      polling_ = false;
      report_parameters(all);
    });
  });
}

void Hub::report_parameters(const Edge::SharedParameters& now) {
  if (now == reported_) return;
  reported_ = now;
  const bool first = parameters_.empty();
  std::vector<foxglove::Parameter> changed;
  for (const NamedParameter& parameter : *now) {
    const std::string name = foxglove::parameter_name(parameter.node, parameter.name);
    const auto [entry, is_new] = parameters_.try_emplace(name, parameter.value);
    if (!is_new && entry->second == parameter.value) continue;
    entry->second = parameter.value;
    if (!first) changed.push_back({name, parameter.value});
  }
  if (changed.empty()) return;
  for (auto& [id, client] : clients_) {
    foxglove::ParameterValues values;
    for (const foxglove::Parameter& parameter : changed) {
      if (client.watches_all_parameters || client.watched_parameters.contains(parameter.name))
        values.parameters.push_back(parameter);
    }
    if (!values.parameters.empty()) client.link->send(make_frame(foxglove::to_frame(values)));
  }
}

}  // namespace doppel
