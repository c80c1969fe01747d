#pragma once
// Bodies that a robot holds between its fingers, found from contacts alone: no finger has to be named as one.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

// Two fingers hold a body if their normals into it are this far from parallel: 107 degrees or more, so that three
// fingers at 120 degrees do, and a tray with a rim does not.
inline constexpr double kOpposedCosine = -0.3;
inline bool opposed(const Eigen::Vector3d& normal_a, const Eigen::Vector3d& normal_b) {
  return normal_a.dot(normal_b) < kOpposedCosine;
}

// True if an instance can be held: an object whose base moves freely.
[[nodiscard]] inline bool can_be_held(const ModelInstance& instance) {
  return instance.is_object() && instance.floating();
}
// True if the links of an instance count as fingers.
[[nodiscard]] inline bool has_fingers(const ModelInstance& instance) {
  return !instance.is_object();
}

// A link that touches a held body.
struct GraspLink {
  int link = 0;                                          // of the robot
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();         // m: the centre of its contacts, weighted by force
  Eigen::Vector3d normal_W = Eigen::Vector3d::Zero();    // unit, into the body
  double pressure = 0;                                   // N along the normals, summed over its contacts
  Eigen::Vector3d friction_W = Eigen::Vector3d::Zero();  // N in the tangent planes, on the body
  double capacity = 0;                                   // N: coefficient of friction times pressure
};

struct DOPPEL_API Grasp {
  int robot = -1;  // instance
  BodyId body;
  std::vector<GraspLink> links;  // ascending
  bool supported = false;        // the body also touches something else than the robot

  [[nodiscard]] double pressure() const;  // N, summed over the links
  [[nodiscard]] double capacity() const;  // N
  // The largest share of its friction that a link uses, 0 to 1; 0 without pressure.
  [[nodiscard]] double friction_used() const;
};

// Replaces the content of `out` by the grasps among the contacts of a state, in the order of robots and bodies:
// at least two links of one robot touch the body, and the normals of two of them are opposed. Allocates.
DOPPEL_API void find_grasps(const CompiledWorld& world, std::span<const Contact> contacts,
                            std::vector<Grasp>& out);

}  // namespace doppel
