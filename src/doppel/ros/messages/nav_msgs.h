#pragma once
// ROS 2's nav_msgs: odometry, maps and paths of mobile robots (m, rad).

#include "doppel/ros/messages/geometry_msgs.h"

namespace doppel::nav_msgs::msg {

struct GridCells {
  std_msgs::msg::Header header;
  float cell_width = 0, cell_height = 0;
  std::vector<geometry_msgs::msg::Point> cells;
  DOPPEL_MESSAGE("nav_msgs/msg/GridCells", header, cell_width, cell_height, cells)
};

struct MapMetaData {
  builtin_interfaces::msg::Time map_load_time;
  float resolution = 0;
  std::uint32_t width = 0, height = 0;
  geometry_msgs::msg::Pose origin;
  DOPPEL_MESSAGE("nav_msgs/msg/MapMetaData", map_load_time, resolution, width, height, origin)
};

struct OccupancyGrid {
  std_msgs::msg::Header header;
  MapMetaData info;
  std::vector<std::int8_t> data;  // [height * width], per cent occupied; -1: unknown
  DOPPEL_MESSAGE("nav_msgs/msg/OccupancyGrid", header, info, data)
};

struct Odometry {
  std_msgs::msg::Header header;
  std::string child_frame_id;
  geometry_msgs::msg::PoseWithCovariance pose;
  geometry_msgs::msg::TwistWithCovariance twist;
  DOPPEL_MESSAGE("nav_msgs/msg/Odometry", header, child_frame_id, pose, twist)
};

struct Path {
  std_msgs::msg::Header header;
  std::vector<geometry_msgs::msg::PoseStamped> poses;
  DOPPEL_MESSAGE("nav_msgs/msg/Path", header, poses)
};

}  // namespace doppel::nav_msgs::msg

namespace doppel::nav_msgs::srv {

struct GetMap {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("nav_msgs/srv/GetMap_Request")
  };
  struct Response {
    msg::OccupancyGrid map;
    DOPPEL_MESSAGE("nav_msgs/srv/GetMap_Response", map)
  };
};

struct GetPlan {
  struct Request {
    geometry_msgs::msg::PoseStamped start, goal;
    float tolerance = 0;
    DOPPEL_MESSAGE("nav_msgs/srv/GetPlan_Request", start, goal, tolerance)
  };
  struct Response {
    msg::Path plan;
    DOPPEL_MESSAGE("nav_msgs/srv/GetPlan_Response", plan)
  };
};

struct LoadMap {
  struct Request {
    std::string map_url;
    DOPPEL_MESSAGE("nav_msgs/srv/LoadMap_Request", map_url)
  };
  struct Response {
    static constexpr std::uint8_t RESULT_SUCCESS = 0, RESULT_MAP_DOES_NOT_EXIST = 1,
                                  RESULT_INVALID_MAP_DATA = 2, RESULT_INVALID_MAP_METADATA = 3,
                                  RESULT_UNDEFINED_FAILURE = 255;
    msg::OccupancyGrid map;
    std::uint8_t result = 0;
    DOPPEL_MESSAGE("nav_msgs/srv/LoadMap_Response", map, result)
    DOPPEL_CONSTANTS(RESULT_SUCCESS, RESULT_MAP_DOES_NOT_EXIST, RESULT_INVALID_MAP_DATA,
                     RESULT_INVALID_MAP_METADATA, RESULT_UNDEFINED_FAILURE)
  };
};

struct SetMap {
  struct Request {
    msg::OccupancyGrid map;
    geometry_msgs::msg::PoseWithCovarianceStamped initial_pose;
    DOPPEL_MESSAGE("nav_msgs/srv/SetMap_Request", map, initial_pose)
  };
  struct Response {
    bool success = false;
    DOPPEL_MESSAGE("nav_msgs/srv/SetMap_Response", success)
  };
};

}  // namespace doppel::nav_msgs::srv
