#pragma once
// The stamp of a message as a time.

#include "doppel/base/core/time.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel::test {

inline Time time_of(const std_msgs::msg::Header& header) {
  return from_msg(header.stamp);
}

}  // namespace doppel::test
