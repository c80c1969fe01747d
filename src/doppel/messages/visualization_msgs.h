#pragma once
// ROS 2's visualization_msgs (Jazzy), as far as RViz's markers go.

#include "doppel/messages/geometry_msgs.h"
#include "doppel/messages/sensor_msgs.h"

namespace doppel::visualization_msgs::msg {

struct UVCoordinate {
  float u = 0, v = 0;
  DOPPEL_MESSAGE("visualization_msgs/msg/UVCoordinate", u, v)
};

struct MeshFile {
  std::string filename;
  std::vector<std::uint8_t> data;
  DOPPEL_MESSAGE("visualization_msgs/msg/MeshFile", filename, data)
};

struct Marker {
  static constexpr std::int32_t ARROW = 0, CUBE = 1, SPHERE = 2, CYLINDER = 3, LINE_STRIP = 4, LINE_LIST = 5,
                                CUBE_LIST = 6, SPHERE_LIST = 7, POINTS = 8, TEXT_VIEW_FACING = 9,
                                MESH_RESOURCE = 10, TRIANGLE_LIST = 11, ARROW_STRIP = 12;
  static constexpr std::int32_t ADD = 0, MODIFY = 0, DELETE = 2, DELETEALL = 3;
  std_msgs::msg::Header header;
  std::string ns;
  std::int32_t id = 0, type = ARROW, action = ADD;
  geometry_msgs::msg::Pose pose;
  geometry_msgs::msg::Vector3 scale;
  std_msgs::msg::ColorRGBA color;
  builtin_interfaces::msg::Duration lifetime;  // zero: for ever
  bool frame_locked = false;
  std::vector<geometry_msgs::msg::Point> points;
  std::vector<std_msgs::msg::ColorRGBA> colors;
  std::string texture_resource;
  sensor_msgs::msg::CompressedImage texture;
  std::vector<UVCoordinate> uv_coordinates;
  std::string text;
  std::string mesh_resource;  // a URI
  MeshFile mesh_file;
  bool mesh_use_embedded_materials = false;
  DOPPEL_MESSAGE("visualization_msgs/msg/Marker", header, ns, id, type, action, pose, scale, color, lifetime,
                 frame_locked, points, colors, texture_resource, texture, uv_coordinates, text, mesh_resource,
                 mesh_file, mesh_use_embedded_materials)
  DOPPEL_CONSTANTS(ARROW, CUBE, SPHERE, CYLINDER, LINE_STRIP, LINE_LIST, CUBE_LIST, SPHERE_LIST, POINTS,
                   TEXT_VIEW_FACING, MESH_RESOURCE, TRIANGLE_LIST, ARROW_STRIP, ADD, MODIFY, DELETE,
                   DELETEALL)
};

struct MarkerArray {
  std::vector<Marker> markers;
  DOPPEL_MESSAGE("visualization_msgs/msg/MarkerArray", markers)
};

}  // namespace doppel::visualization_msgs::msg
