#include "doppel/ros/network/detail/bridge_yielding.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>

#include "doppel/ros/bus/name_rules.h"

namespace doppel::ros2 {
namespace {

constexpr std::string_view kTwinNode = "/doppel";  // of every twin, in any namespace

// Two twins would both yield, so that the one with the smaller id serves.
std::set<Gid> participants_that_yield(const std::vector<GraphNode>& nodes, const Gid& self) {
  std::set<Gid> out;
  for (const GraphNode& node : nodes) {
    if (node.participant == self || (node.name.ends_with(kTwinNode) && self < node.participant))
      out.insert(node.participant);
  }
  return out;
}

}  // namespace

void YieldedNames::follow(const std::vector<ServiceInfo>& services) {
  services_.clear();
  for (const ServiceInfo& service : services) {
    if (service.yields) services_.emplace(service.name, service.node);
  }
  update();
}

bool YieldedNames::look_at(const std::vector<GraphNode>& nodes, const std::vector<GraphService>& services,
                           const Gid& self) {
  if (policy_ != Yielding::to_others) return false;
  const std::set<Gid> yield = participants_that_yield(nodes, self);
  const auto goes_first = [&yield](const Gid& gid) {
    return std::ranges::none_of(yield, [&gid](const Gid& one) { return is_same_participant(one, gid); });
  };
  others_.clear();
  other_nodes_.clear();
  for (const GraphNode& node : nodes) {
    if (goes_first(node.participant)) other_nodes_.insert(node.name);
  }
  for (const GraphService& service : services) {
    const auto server = std::ranges::find_if(service.servers, goes_first, &GraphEndpoint::gid);
    if (server != service.servers.end())
      others_.emplace(service.name,
                      fmt::format("node {} in {}", server->node, place_of(server->gid, self, name_process_)));
  }
  const std::set<std::string> before = hidden_, nodes_before = hidden_nodes_;
  update();
  log_changes(before);
  return hidden_ != before || hidden_nodes_ != nodes_before;
}

void YieldedNames::update() {
  hidden_.clear();
  hidden_nodes_.clear();
  for (const auto& [service, node] : services_) {
    if (policy_ == Yielding::always || others_.contains(service)) hidden_.insert(service);
    if (policy_ == Yielding::always || other_nodes_.contains(node)) hidden_nodes_.insert(node);
  }
}

void YieldedNames::log_changes(const std::set<std::string>& before) const {
  std::map<std::string, std::vector<std::string>> fresh;  // names by their new server
  std::vector<std::string> again;
  for (const std::string& name : hidden_) {
    if (!before.contains(name)) fresh[others_.at(name)].push_back(name);
  }
  std::ranges::set_difference(before, hidden_, std::back_inserter(again));
  for (const auto& [server, names] : fresh) {
    log_.note(
        node_base_name(services_.at(names.front())),
        fmt::format("{} serves {}: on the network those of the twin step back until it ends; its page and "
                    "'doppel --port' have them (--move-group on keeps them there)",
                    server, fmt::join(names, ", ")));
  }
  std::erase_if(again, [this](const std::string& name) { return !services_.contains(name); });
  if (!again.empty())
    log_.note(node_base_name(services_.at(again.front())),
              fmt::format("the twin serves {} on the network again", fmt::join(again, ", ")));
}

}  // namespace doppel::ros2
