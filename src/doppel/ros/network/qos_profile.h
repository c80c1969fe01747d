#pragma once
// Quality of service as in ROS 2 (rmw_qos_profile_t), and the compatibility of two endpoints.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel::ros2 {

enum class Reliability : std::uint8_t { reliable, best_effort };
enum class Durability : std::uint8_t { volatile_, transient_local };
// unknown: the history of a peer is not part of discovery; its depth is 0.
enum class History : std::uint8_t { keep_last, keep_all, unknown };
enum class Liveliness : std::uint8_t { automatic, manual_by_topic };

struct QosProfile {
  static constexpr std::chrono::nanoseconds kInfinite = std::chrono::nanoseconds::max();

  Reliability reliability = Reliability::reliable;
  Durability durability = Durability::volatile_;
  History history = History::keep_last;
  std::size_t depth = 10;
  std::chrono::nanoseconds deadline = kInfinite, lifespan = kInfinite, lease = kInfinite;
  Liveliness liveliness = Liveliness::automatic;
};

// rmw's profiles: rmw_qos_profile_default, _sensor_data, _services_default, _parameter_events; "latched" is
// that of /tf_static and /robot_description.
constexpr QosProfile default_qos() {
  return {};
}
constexpr QosProfile sensor_data_qos() {
  return {.reliability = Reliability::best_effort, .depth = 5};
}
constexpr QosProfile services_qos() {
  return {};
}
constexpr QosProfile parameter_events_qos() {
  return {.depth = 1000};
}
constexpr QosProfile latched_qos(std::size_t depth = 1) {
  return {.durability = Durability::transient_local, .depth = depth};
}

// The incompatible policy by rclcpp's name ("RELIABILITY_QOS_POLICY"); of several the one with the highest
// DDS id, which DDS reports to rclcpp. "": they are compatible.
DOPPEL_API std::string_view incompatible_policy(const QosProfile& offered, const QosProfile& wanted);

// The reason why a reader that requests `wanted` does not match a writer that offers `offered`;
// "": they match.
DOPPEL_API std::string incompatibility(const QosProfile& offered, const QosProfile& wanted);

}  // namespace doppel::ros2
