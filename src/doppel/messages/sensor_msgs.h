#pragma once
// ROS 2's sensor_msgs: the state of joints (rad or m, rad/s or m/s, N m or N), and images.

#include "doppel/messages/std_msgs.h"

namespace doppel::sensor_msgs::msg {

struct JointState {
  std_msgs::msg::Header header;
  std::vector<std::string> name;
  std::vector<double> position, velocity, effort;
  DOPPEL_MESSAGE("sensor_msgs/msg/JointState", header, name, position, velocity, effort)
};

struct Image {
  std_msgs::msg::Header header;
  std::uint32_t height = 0, width = 0;  // pixels
  std::string encoding;                 // "rgb8", "32FC1", ...
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;          // bytes of a row
  std::vector<std::uint8_t> data;  // [step * height]
  DOPPEL_MESSAGE("sensor_msgs/msg/Image", header, height, width, encoding, is_bigendian, step, data)
};

struct CompressedImage {
  std_msgs::msg::Header header;
  std::string format;  // "jpeg", "png"
  std::vector<std::uint8_t> data;
  DOPPEL_MESSAGE("sensor_msgs/msg/CompressedImage", header, format, data)
};

struct RegionOfInterest {
  std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;  // pixels
  bool do_rectify = false;
  DOPPEL_MESSAGE("sensor_msgs/msg/RegionOfInterest", x_offset, y_offset, height, width, do_rectify)
};

struct CameraInfo {
  std_msgs::msg::Header header;
  std::uint32_t height = 0, width = 0;  // pixels
  std::string distortion_model;         // "plumb_bob"
  std::vector<double> d;                // distortion
  std::array<double, 9> k{};            // intrinsics, row by row
  std::array<double, 9> r{};            // rectification
  std::array<double, 12> p{};           // projection
  std::uint32_t binning_x = 0, binning_y = 0;
  RegionOfInterest roi;
  DOPPEL_MESSAGE("sensor_msgs/msg/CameraInfo", header, height, width, distortion_model, d, k, r, p, binning_x,
                 binning_y, roi)
};

}  // namespace doppel::sensor_msgs::msg
