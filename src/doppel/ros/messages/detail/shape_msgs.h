#pragma once
// ROS 2's shape_msgs: solids and meshes (m) of planning scenes.

#include "doppel/ros/messages/geometry_msgs.h"

namespace doppel::shape_msgs::msg {

struct MeshTriangle {
  std::array<std::uint32_t, 3> vertex_indices{};
  DOPPEL_MESSAGE("shape_msgs/msg/MeshTriangle", vertex_indices)
};

struct Mesh {
  std::vector<MeshTriangle> triangles;
  std::vector<geometry_msgs::msg::Point> vertices;
  DOPPEL_MESSAGE("shape_msgs/msg/Mesh", triangles, vertices)
};

struct Plane {
  std::array<double, 4> coef{};  // a x + b y + c z + d = 0
  DOPPEL_MESSAGE("shape_msgs/msg/Plane", coef)
};

struct SolidPrimitive {
  static constexpr std::uint8_t BOX = 1, SPHERE = 2, CYLINDER = 3, CONE = 4, PRISM = 5, BOX_X = 0, BOX_Y = 1,
                                BOX_Z = 2, SPHERE_RADIUS = 0, CYLINDER_HEIGHT = 0, CYLINDER_RADIUS = 1,
                                CONE_HEIGHT = 0, CONE_RADIUS = 1, PRISM_HEIGHT = 0;
  std::uint8_t type = 0;
  BoundedVector<double, 3> dimensions;
  geometry_msgs::msg::Polygon polygon;
  DOPPEL_MESSAGE("shape_msgs/msg/SolidPrimitive", type, dimensions, polygon)
  DOPPEL_CONSTANTS(BOX, SPHERE, CYLINDER, CONE, PRISM, BOX_X, BOX_Y, BOX_Z, SPHERE_RADIUS, CYLINDER_HEIGHT,
                   CYLINDER_RADIUS, CONE_HEIGHT, CONE_RADIUS, PRISM_HEIGHT)
};

}  // namespace doppel::shape_msgs::msg
