#pragma once
// ROS 2's statistics_msgs: statistics of subscriptions about their topics.

#include "doppel/ros/messages/builtin_interfaces.h"

namespace doppel::statistics_msgs::msg {

struct StatisticDataPoint {
  std::uint8_t data_type = 0;
  double data = 0;
  DOPPEL_MESSAGE("statistics_msgs/msg/StatisticDataPoint", data_type, data)
};

struct MetricsMessage {
  std::string measurement_source_name, metrics_source, unit;
  builtin_interfaces::msg::Time window_start, window_stop;
  std::vector<StatisticDataPoint> statistics;
  DOPPEL_MESSAGE("statistics_msgs/msg/MetricsMessage", measurement_source_name, metrics_source, unit,
                 window_start, window_stop, statistics)
};

struct StatisticDataType {
  static constexpr std::uint8_t STATISTICS_DATA_TYPE_UNINITIALIZED = 0, STATISTICS_DATA_TYPE_AVERAGE = 1,
                                STATISTICS_DATA_TYPE_MINIMUM = 2, STATISTICS_DATA_TYPE_MAXIMUM = 3,
                                STATISTICS_DATA_TYPE_STDDEV = 4, STATISTICS_DATA_TYPE_SAMPLE_COUNT = 5;
  DOPPEL_EMPTY_MESSAGE("statistics_msgs/msg/StatisticDataType")
  DOPPEL_CONSTANTS(STATISTICS_DATA_TYPE_UNINITIALIZED, STATISTICS_DATA_TYPE_AVERAGE,
                   STATISTICS_DATA_TYPE_MINIMUM, STATISTICS_DATA_TYPE_MAXIMUM, STATISTICS_DATA_TYPE_STDDEV,
                   STATISTICS_DATA_TYPE_SAMPLE_COUNT)
};

}  // namespace doppel::statistics_msgs::msg
