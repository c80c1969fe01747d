#pragma once
// ROS 2's std_msgs.

#include "doppel/ros/messages/builtin_interfaces.h"

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

struct Byte {
  std::byte data{};
  DOPPEL_MESSAGE("std_msgs/msg/Byte", data)
};

struct ByteMultiArray {
  MultiArrayLayout layout;
  std::vector<std::byte> data;
  DOPPEL_MESSAGE("std_msgs/msg/ByteMultiArray", layout, data)
};

struct Char {
  std::uint8_t data = 0;
  DOPPEL_MESSAGE("std_msgs/msg/Char", data)
};

struct Float32 {
  float data = 0;
  DOPPEL_MESSAGE("std_msgs/msg/Float32", data)
};

struct Float32MultiArray {
  MultiArrayLayout layout;
  std::vector<float> data;
  DOPPEL_MESSAGE("std_msgs/msg/Float32MultiArray", layout, data)
};

struct Int16 {
  std::int16_t data = 0;
  DOPPEL_MESSAGE("std_msgs/msg/Int16", data)
};

struct Int16MultiArray {
  MultiArrayLayout layout;
  std::vector<std::int16_t> data;
  DOPPEL_MESSAGE("std_msgs/msg/Int16MultiArray", layout, data)
};

struct Int32MultiArray {
  MultiArrayLayout layout;
  std::vector<std::int32_t> data;
  DOPPEL_MESSAGE("std_msgs/msg/Int32MultiArray", layout, data)
};

struct Int64 {
  std::int64_t data = 0;
  DOPPEL_MESSAGE("std_msgs/msg/Int64", data)
};

struct Int64MultiArray {
  MultiArrayLayout layout;
  std::vector<std::int64_t> data;
  DOPPEL_MESSAGE("std_msgs/msg/Int64MultiArray", layout, data)
};

struct Int8 {
  std::int8_t data = 0;
  DOPPEL_MESSAGE("std_msgs/msg/Int8", data)
};

struct Int8MultiArray {
  MultiArrayLayout layout;
  std::vector<std::int8_t> data;
  DOPPEL_MESSAGE("std_msgs/msg/Int8MultiArray", layout, data)
};

struct UInt16 {
  std::uint16_t data = 0;
  DOPPEL_MESSAGE("std_msgs/msg/UInt16", data)
};

struct UInt16MultiArray {
  MultiArrayLayout layout;
  std::vector<std::uint16_t> data;
  DOPPEL_MESSAGE("std_msgs/msg/UInt16MultiArray", layout, data)
};

struct UInt32 {
  std::uint32_t data = 0;
  DOPPEL_MESSAGE("std_msgs/msg/UInt32", data)
};

struct UInt32MultiArray {
  MultiArrayLayout layout;
  std::vector<std::uint32_t> data;
  DOPPEL_MESSAGE("std_msgs/msg/UInt32MultiArray", layout, data)
};

struct UInt64 {
  std::uint64_t data = 0;
  DOPPEL_MESSAGE("std_msgs/msg/UInt64", data)
};

struct UInt64MultiArray {
  MultiArrayLayout layout;
  std::vector<std::uint64_t> data;
  DOPPEL_MESSAGE("std_msgs/msg/UInt64MultiArray", layout, data)
};

struct UInt8 {
  std::uint8_t data = 0;
  DOPPEL_MESSAGE("std_msgs/msg/UInt8", data)
};

struct UInt8MultiArray {
  MultiArrayLayout layout;
  std::vector<std::uint8_t> data;
  DOPPEL_MESSAGE("std_msgs/msg/UInt8MultiArray", layout, data)
};

}  // namespace doppel::std_msgs::msg
