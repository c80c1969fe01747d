#include "doppel/ros/network/qos_profile.h"

#include <fmt/format.h>

namespace doppel::ros2 {
namespace {

constexpr std::string_view kReliability = "RELIABILITY_QOS_POLICY", kDurability = "DURABILITY_QOS_POLICY",
                           kDeadline = "DEADLINE_QOS_POLICY", kLiveliness = "LIVELINESS_QOS_POLICY";

std::string seconds_text(std::chrono::nanoseconds duration) {
  if (duration == QosProfile::kInfinite) return "infinite";
  return fmt::format("{} s", std::chrono::duration<double>(duration).count());
}

}  // namespace

// DDS 1.4, clause 2.2.3: the offered QoS must be at least the requested one.
std::string_view incompatible_policy(const QosProfile& offered, const QosProfile& wanted) {
  if (offered.reliability == Reliability::best_effort && wanted.reliability == Reliability::reliable)
    return kReliability;
  if (offered.liveliness == Liveliness::automatic && wanted.liveliness == Liveliness::manual_by_topic)
    return kLiveliness;
  if (offered.lease > wanted.lease) return kLiveliness;
  if (offered.deadline > wanted.deadline) return kDeadline;
  if (offered.durability == Durability::volatile_ && wanted.durability == Durability::transient_local)
    return kDurability;
  return "";
}

std::string incompatibility(const QosProfile& offered, const QosProfile& wanted) {
  const std::string_view policy = incompatible_policy(offered, wanted);
  if (policy == kReliability) return "reliability: best effort is offered, reliable is requested";
  if (policy == kDurability) return "durability: volatile is offered, transient local is requested";
  if (policy == kDeadline)
    return fmt::format("deadline: {} is offered, {} is requested", seconds_text(offered.deadline),
                       seconds_text(wanted.deadline));
  if (policy != kLiveliness) return "";
  if (offered.lease <= wanted.lease) return "liveliness: automatic is offered, manual by topic is requested";
  return fmt::format("liveliness lease: {} is offered, {} is requested", seconds_text(offered.lease),
                     seconds_text(wanted.lease));
}

}  // namespace doppel::ros2
