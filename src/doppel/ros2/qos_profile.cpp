#include "doppel/ros2/qos_profile.h"

#include <fmt/format.h>

namespace doppel::ros2 {
namespace {

std::string seconds(std::chrono::nanoseconds duration) {
  if (duration == QosProfile::kInfinite) return "infinite";
  return fmt::format("{} s", std::chrono::duration<double>(duration).count());
}

}  // namespace

// DDS 1.4, table 2.2.3: what is offered must be at least what is wanted.
std::string incompatibility(const QosProfile& offered, const QosProfile& wanted) {
  if (offered.reliability == Reliability::best_effort && wanted.reliability == Reliability::reliable)
    return "reliability: best effort is offered, reliable is wanted";
  if (offered.durability == Durability::volatile_ && wanted.durability == Durability::transient_local)
    return "durability: volatile is offered, transient local is wanted";
  if (offered.deadline > wanted.deadline)
    return fmt::format("deadline: {} is offered, {} is wanted", seconds(offered.deadline),
                       seconds(wanted.deadline));
  if (offered.liveliness == Liveliness::automatic && wanted.liveliness == Liveliness::manual_by_topic)
    return "liveliness: automatic is offered, manual by topic is wanted";
  if (offered.lease > wanted.lease)
    return fmt::format("liveliness lease: {} is offered, {} is wanted", seconds(offered.lease),
                       seconds(wanted.lease));
  return "";
}

}  // namespace doppel::ros2
