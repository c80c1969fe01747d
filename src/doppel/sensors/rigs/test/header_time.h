#pragma once
// The stamp of a message as a time.

#include "doppel/base/core/time.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel::test {

inline Time time_of(const std_msgs::msg::Header& header) {
  return Time{std::int64_t{header.stamp.sec} * 1'000'000'000 + header.stamp.nanosec};
}

}  // namespace doppel::test
