#pragma once
// Times and durations of messages from and to those of the program.

#include "doppel/base/core/time.h"
#include "doppel/ros/messages/builtin_interfaces.h"

namespace doppel {

namespace messages_detail {
template <class Stamp>
constexpr Stamp split_nanoseconds(std::chrono::nanoseconds total) {
  constexpr std::int64_t kBillion = 1'000'000'000;
  std::int64_t sec = total.count() / kBillion, nanosec = total.count() % kBillion;
  if (nanosec < 0)
    --sec, nanosec += kBillion;  // ROS 2 keeps nanosec positive: -0.5 s is {sec: -1, nanosec: 5e8}
  return {static_cast<std::int32_t>(sec), static_cast<std::uint32_t>(nanosec)};
}
}  // namespace messages_detail

// Precondition: |seconds| < 2^31.
constexpr builtin_interfaces::msg::Time to_time_msg(Time time) {
  return messages_detail::split_nanoseconds<builtin_interfaces::msg::Time>(time.time_since_epoch());
}
constexpr builtin_interfaces::msg::Duration to_duration_msg(Duration duration) {
  return messages_detail::split_nanoseconds<builtin_interfaces::msg::Duration>(duration);
}
constexpr Time from_msg(const builtin_interfaces::msg::Time& time) {
  return Time(std::chrono::seconds(time.sec) + std::chrono::nanoseconds(time.nanosec));
}
constexpr Duration from_msg(const builtin_interfaces::msg::Duration& duration) {
  return std::chrono::seconds(duration.sec) + std::chrono::nanoseconds(duration.nanosec);
}

}  // namespace doppel
