#pragma once
// PAL Robotics' pal_statistics_msgs: the internal statistics of ros2_control.

#include "doppel/ros/messages/std_msgs.h"

namespace doppel::pal_statistics_msgs::msg {

struct Statistic {
  std::string name;
  double value = 0;
  DOPPEL_MESSAGE("pal_statistics_msgs/msg/Statistic", name, value)
};

struct Statistics {
  std_msgs::msg::Header header;
  std::vector<Statistic> statistics;
  DOPPEL_MESSAGE("pal_statistics_msgs/msg/Statistics", header, statistics)
};

struct StatisticsNames {
  std_msgs::msg::Header header;
  std::vector<std::string> names;
  std::uint32_t names_version = 0;
  DOPPEL_MESSAGE("pal_statistics_msgs/msg/StatisticsNames", header, names, names_version)
};

struct StatisticsValues {
  std_msgs::msg::Header header;
  std::vector<double> values;
  std::uint32_t names_version = 0;
  DOPPEL_MESSAGE("pal_statistics_msgs/msg/StatisticsValues", header, values, names_version)
};

}  // namespace doppel::pal_statistics_msgs::msg
