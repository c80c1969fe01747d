#pragma once
// The markers of ROS 2's visualization_msgs (Jazzy).

#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"

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
  builtin_interfaces::msg::Duration lifetime;  // zero: unlimited
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

struct ImageMarker {
  static constexpr std::int32_t CIRCLE = 0, LINE_STRIP = 1, LINE_LIST = 2, POLYGON = 3, POINTS = 4, ADD = 0,
                                REMOVE = 1;
  std_msgs::msg::Header header;
  std::string ns;
  std::int32_t id = 0, type = 0, action = 0;
  geometry_msgs::msg::Point position;
  float scale = 0;
  std_msgs::msg::ColorRGBA outline_color;
  std::uint8_t filled = 0;
  std_msgs::msg::ColorRGBA fill_color;
  builtin_interfaces::msg::Duration lifetime;
  std::vector<geometry_msgs::msg::Point> points;
  std::vector<std_msgs::msg::ColorRGBA> outline_colors;
  DOPPEL_MESSAGE("visualization_msgs/msg/ImageMarker", header, ns, id, type, action, position, scale,
                 outline_color, filled, fill_color, lifetime, points, outline_colors)
  DOPPEL_CONSTANTS(CIRCLE, LINE_STRIP, LINE_LIST, POLYGON, POINTS, ADD, REMOVE)
};

struct InteractiveMarkerControl {
  static constexpr std::uint8_t INHERIT = 0, FIXED = 1, VIEW_FACING = 2, NONE = 0, MENU = 1, BUTTON = 2,
                                MOVE_AXIS = 3, MOVE_PLANE = 4, ROTATE_AXIS = 5, MOVE_ROTATE = 6, MOVE_3D = 7,
                                ROTATE_3D = 8, MOVE_ROTATE_3D = 9;
  std::string name;
  geometry_msgs::msg::Quaternion orientation;
  std::uint8_t orientation_mode = 0, interaction_mode = 0;
  bool always_visible = false;
  std::vector<Marker> markers;
  bool independent_marker_orientation = false;
  std::string description;
  DOPPEL_MESSAGE("visualization_msgs/msg/InteractiveMarkerControl", name, orientation, orientation_mode,
                 interaction_mode, always_visible, markers, independent_marker_orientation, description)
  DOPPEL_CONSTANTS(INHERIT, FIXED, VIEW_FACING, NONE, MENU, BUTTON, MOVE_AXIS, MOVE_PLANE, ROTATE_AXIS,
                   MOVE_ROTATE, MOVE_3D, ROTATE_3D, MOVE_ROTATE_3D)
};

struct MenuEntry {
  static constexpr std::uint8_t FEEDBACK = 0, ROSRUN = 1, ROSLAUNCH = 2;
  std::uint32_t id = 0, parent_id = 0;
  std::string title, command;
  std::uint8_t command_type = 0;
  DOPPEL_MESSAGE("visualization_msgs/msg/MenuEntry", id, parent_id, title, command, command_type)
  DOPPEL_CONSTANTS(FEEDBACK, ROSRUN, ROSLAUNCH)
};

struct InteractiveMarker {
  std_msgs::msg::Header header;
  geometry_msgs::msg::Pose pose;
  std::string name, description;
  float scale = 0;
  std::vector<MenuEntry> menu_entries;
  std::vector<InteractiveMarkerControl> controls;
  DOPPEL_MESSAGE("visualization_msgs/msg/InteractiveMarker", header, pose, name, description, scale,
                 menu_entries, controls)
};

struct InteractiveMarkerFeedback {
  static constexpr std::uint8_t KEEP_ALIVE = 0, POSE_UPDATE = 1, MENU_SELECT = 2, BUTTON_CLICK = 3,
                                MOUSE_DOWN = 4, MOUSE_UP = 5;
  std_msgs::msg::Header header;
  std::string client_id, marker_name, control_name;
  std::uint8_t event_type = 0;
  geometry_msgs::msg::Pose pose;
  std::uint32_t menu_entry_id = 0;
  geometry_msgs::msg::Point mouse_point;
  bool mouse_point_valid = false;
  DOPPEL_MESSAGE("visualization_msgs/msg/InteractiveMarkerFeedback", header, client_id, marker_name,
                 control_name, event_type, pose, menu_entry_id, mouse_point, mouse_point_valid)
  DOPPEL_CONSTANTS(KEEP_ALIVE, POSE_UPDATE, MENU_SELECT, BUTTON_CLICK, MOUSE_DOWN, MOUSE_UP)
};

struct InteractiveMarkerInit {
  std::string server_id;
  std::uint64_t seq_num = 0;
  std::vector<InteractiveMarker> markers;
  DOPPEL_MESSAGE("visualization_msgs/msg/InteractiveMarkerInit", server_id, seq_num, markers)
};

struct InteractiveMarkerPose {
  std_msgs::msg::Header header;
  geometry_msgs::msg::Pose pose;
  std::string name;
  DOPPEL_MESSAGE("visualization_msgs/msg/InteractiveMarkerPose", header, pose, name)
};

struct InteractiveMarkerUpdate {
  static constexpr std::uint8_t KEEP_ALIVE = 0, UPDATE = 1;
  std::string server_id;
  std::uint64_t seq_num = 0;
  std::uint8_t type = 0;
  std::vector<InteractiveMarker> markers;
  std::vector<InteractiveMarkerPose> poses;
  std::vector<std::string> erases;
  DOPPEL_MESSAGE("visualization_msgs/msg/InteractiveMarkerUpdate", server_id, seq_num, type, markers, poses,
                 erases)
  DOPPEL_CONSTANTS(KEEP_ALIVE, UPDATE)
};

}  // namespace doppel::visualization_msgs::msg

namespace doppel::visualization_msgs::srv {

struct GetInteractiveMarkers {
  struct Request {
    DOPPEL_EMPTY_MESSAGE("visualization_msgs/srv/GetInteractiveMarkers_Request")
  };
  struct Response {
    std::uint64_t sequence_number = 0;
    std::vector<msg::InteractiveMarker> markers;
    DOPPEL_MESSAGE("visualization_msgs/srv/GetInteractiveMarkers_Response", sequence_number, markers)
  };
};

}  // namespace doppel::visualization_msgs::srv
