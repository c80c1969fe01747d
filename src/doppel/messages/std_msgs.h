#pragma once
// ROS 2's std_msgs, as far as arms use them.

#include "doppel/messages/builtin_interfaces.h"

namespace doppel::std_msgs::msg {

struct Header {
  builtin_interfaces::msg::Time stamp;
  std::string frame_id;
  DOPPEL_MESSAGE("std_msgs/msg/Header", stamp, frame_id)
};

struct Empty {
  DOPPEL_EMPTY_MESSAGE("std_msgs/msg/Empty")
};

struct String {
  std::string data;
  DOPPEL_MESSAGE("std_msgs/msg/String", data)
};

struct Bool {
  bool data = false;
  DOPPEL_MESSAGE("std_msgs/msg/Bool", data)
};

struct Int32 {
  std::int32_t data = 0;
  DOPPEL_MESSAGE("std_msgs/msg/Int32", data)
};

struct Float64 {
  double data = 0;
  DOPPEL_MESSAGE("std_msgs/msg/Float64", data)
};

struct ColorRGBA {
  float r = 0, g = 0, b = 0, a = 0;
  DOPPEL_MESSAGE("std_msgs/msg/ColorRGBA", r, g, b, a)
};

struct MultiArrayDimension {
  std::string label;
  std::uint32_t size = 0;
  std::uint32_t stride = 0;
  DOPPEL_MESSAGE("std_msgs/msg/MultiArrayDimension", label, size, stride)
};

struct MultiArrayLayout {
  std::vector<MultiArrayDimension> dim;
  std::uint32_t data_offset = 0;
  DOPPEL_MESSAGE("std_msgs/msg/MultiArrayLayout", dim, data_offset)
};

struct Float64MultiArray {
  MultiArrayLayout layout;
  std::vector<double> data;
  DOPPEL_MESSAGE("std_msgs/msg/Float64MultiArray", layout, data)
};

}  // namespace doppel::std_msgs::msg
