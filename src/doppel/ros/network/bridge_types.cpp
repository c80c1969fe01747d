#include "doppel/ros/network/bridge_types.h"

#include <fmt/format.h>

namespace doppel::ros2 {

QosProfile to_profile(const Qos& qos) {
  QosProfile profile;
  profile.reliability = qos.best_effort ? Reliability::best_effort : Reliability::reliable;
  profile.durability = qos.transient_local() ? Durability::transient_local : Durability::volatile_;
  profile.history = qos.keep_all ? History::keep_all : History::keep_last;
  profile.depth = qos.depth;
  if (qos.lifespan > Duration{}) profile.lifespan = qos.lifespan;
  return profile;
}

std::string message_hash(std::string_view type) {
  const TypeSupport* support = find_type(type);
  return support == nullptr ? "" : support->hash();
}

ServiceSpec service_spec(std::string_view name, std::string_view type) {
  return {.name = std::string(name),
          .type = std::string(type),
          .request_hash = message_hash(fmt::format("{}_Request", type)),
          .response_hash = message_hash(fmt::format("{}_Response", type))};
}

}  // namespace doppel::ros2
