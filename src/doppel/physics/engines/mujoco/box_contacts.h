#pragma once
// Private to the MuJoCo back end: contacts of two boxes. MuJoCo 2.2.2 finds, for boxes that are parallel except
// for rounding and have just touched, an axis between two edges that are parallel, and reports a depth of
// decimetres: a robot that touches a table is thrown away. Its result is checked here against the overlap
// along the boxes' face normals, which no penetration exceeds, and replaced where it is wrong.

#include <Eigen/Geometry>
#include <vector>

namespace doppel {

struct PlacedBox {
  Eigen::Vector3d half = Eigen::Vector3d::Zero();  // m, half side lengths
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
};

// Largest signed distance of the boxes along their six face normals: negative where they overlap on all of
// them, by the depth of the penetration at most. m
double face_distance(const PlacedBox& a, const PlacedBox& b);

struct BoxContactPoint {
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  // m, between the surfaces
  double distance = 0;                            // m, negative: penetrating
};

struct BoxContacts {
  Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();  // unit, from a to b
  int count = 0;
  BoxContactPoint points[8];
};

// The contact of the face along whose normal the boxes are nearest, with the part of the other box's nearest
// face that lies above it, clipped at its sides. Does not allocate.
BoxContacts face_contacts(const PlacedBox& a, const PlacedBox& b, double margin);

// Checks and replaces in all worlds of this process. Idempotent; not thread-safe.
void install_checked_box_contacts();

}  // namespace doppel
