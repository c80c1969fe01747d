#pragma once
// The bytes of sensor_msgs/Image. Formats by SDF's names, encodings by ROS's (sensor_msgs/image_encodings.hpp).

#include <cstdint>
#include <string>
#include <vector>

#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {

// Light is multiplied by `factor`, in place; sRGB.
void expose(double factor, std::vector<std::uint8_t>& rgb);
// Sets encoding, step and data; width and height are set. An unknown format is rgb8.
void encode_pixels(const std::string& format, int width, const std::vector<std::uint8_t>& rgb,
                   sensor_msgs::msg::Image& image);
// 32FC1 in m, or with a format of 16 bits 16UC1 in mm, where 0 is no depth.
void encode_depths(const std::string& format, const std::vector<float>& depths,
                   sensor_msgs::msg::Image& image);
void encode_labels(const std::vector<std::uint32_t>& labels, sensor_msgs::msg::Image& image);  // mono16
// rgb8, as gz-sensors: of ObjectLabels::panoptic_of() the class in blue, the number's high byte in green, its low in red.
void encode_panoptic(const std::vector<std::uint32_t>& labels, sensor_msgs::msg::Image& image);
// rgb8: a colour for each label; black is nothing.
void colour_labels(const std::vector<std::uint32_t>& labels, sensor_msgs::msg::Image& image);

}  // namespace doppel
