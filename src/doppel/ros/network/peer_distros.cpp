#include "doppel/ros/network/peer_distros.h"

#include <algorithm>

#include "doppel/ros/messages/codec.h"

namespace doppel::ros2 {
namespace {

template <class Look>
void for_each_end(const std::vector<GraphTopic>& topics, const std::vector<GraphService>& services,
                  Look look) {
  for (const GraphTopic& topic : topics) {
    for (const auto* const ends : {&topic.publishers, &topic.subscriptions})
      for (const GraphEndpoint& end : *ends) look(end, "");
  }
  for (const GraphService& service : services) {
    for (const auto* const ends : {&service.servers, &service.clients})
      for (const GraphEndpoint& end : *ends) look(end, "_Request");
    for (const auto* const ends : {&service.reply_servers, &service.reply_clients})
      for (const GraphEndpoint& end : *ends) look(end, "_Response");
  }
}

}  // namespace

std::optional<ForeignType> foreign_type(const GraphEndpoint& endpoint, const char* part) {
  if (endpoint.type_hash.empty()) return std::nullopt;
  ForeignType found{endpoint.type + part, {}};
  const TypeSupport* const type = find_type(found.type);
  if (type == nullptr || type->hash() == endpoint.type_hash) return std::nullopt;
  found.distros = distros_with(found.type, endpoint.type_hash);
  return found;
}

std::optional<Distro> distro_of_peers(const std::vector<GraphTopic>& topics,
                                      const std::vector<GraphService>& services, const Gid& self) {
  std::vector<Distro> fitting{Distro::jazzy, Distro::kilted, Distro::lyrical};
  for_each_end(topics, services, [&](const GraphEndpoint& end, const char* part) {
    if (is_same_participant(end.gid, self) || end.type_hash.empty()) return;
    const std::vector<Distro> with = distros_with(end.type + part, end.type_hash);
    if (with.empty()) return;  // of none of them
    std::erase_if(fitting, [&](Distro distro) { return std::ranges::find(with, distro) == with.end(); });
  });
  if (fitting.empty() || std::ranges::find(fitting, ros_distro()) != fitting.end()) return std::nullopt;
  return fitting.back();
}

std::string title_of(const std::vector<Distro>& distros) {
  std::string text;
  for (const Distro distro : distros)
    text += text.empty() ? title(distro) : " or " + title(distro).substr(std::string_view("ROS 2 ").size());
  return text;
}

}  // namespace doppel::ros2
