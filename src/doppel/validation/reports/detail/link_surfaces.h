#pragma once
// The visible surface of each link, with few triangles, for pictures in a report.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

struct LinkSurface {
  int link = -1;  // of the model
  std::string name;
  Eigen::Vector3f colour = Eigen::Vector3f::Constant(0.6F);  // 0..1
  std::vector<Eigen::Vector3f> vertices;                     // in the link's frame, m
  std::vector<std::array<std::uint32_t, 3>> triangles;       // counter-clockwise seen from outside
};

// The visual shapes, of a link without them the collision shapes; links without shapes are left out, and so
// are meshes that cannot be read.
[[nodiscard]] std::vector<LinkSurface> link_surfaces(const RobotDescription& robot, const Model& model);

// With at most about `triangles` triangles in all, by clusters of vertices. Source: Rossignac and Borrel
// 1993, "Multi-resolution 3D approximations for rendering complex scenes".
[[nodiscard]] std::vector<LinkSurface> simplified(const std::vector<LinkSurface>& surfaces,
                                                  std::size_t triangles);

}  // namespace doppel
