#pragma once
// The parts of a mobile robot that roll or slide on the ground: wheels, whose collision shapes become exact
// rolling shapes, and casters that are a fixed ball or skid.
//
// A wheel as a cylinder or as the hull of a mesh touches the ground in several points that change while it
// turns: it jolts, and scrubs when it steers. As an ellipsoid of its radius and width it touches the ground
// in one point below its middle and rolls by exactly its radius, also against walls and over steps.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/robot/collision/link_shapes.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

struct RollingPart {
  enum class Kind { wheel, caster };
  Kind kind = Kind::wheel;
  int link = -1;                                       // whose shape touches the ground
  int joint = -1;                                      // about which a wheel turns; -1: a caster
  Eigen::Vector3d axis_L = Eigen::Vector3d::UnitY();   // unit, axle in the link frame; of a wheel
  Eigen::Vector3d centre_L = Eigen::Vector3d::Zero();  // m, of the shape in the link frame
  double radius = 0;                                   // m; 0: a skid that is not round
  double width = 0;                                    // m, along the axle; of a wheel
  Friction friction;
  std::string shape;  // of which it was made: "cylinder", "sphere", "mesh", ...
};

inline constexpr double kCasterFriction = 0.05;  // Coulomb, of a ball that stands for a rolling part

// Finds wheels and casters of a model that moves freely, and gives its shapes their rolling form. The others
// keep their shapes.
//
// A wheel is a shape that is round about the axis of a continuous joint (or of one with more than two turns)
// that is horizontal at q0 and has no moving joint behind it: a cylinder or sphere, or a mesh whose hull has
// the same radius in all directions within 4 %. It is not wider than its diameter, no other shape of its link
// protrudes from it, and its bottom is near the robot's lowest point. A caster is a sphere, or a shape of a
// link named caster, ball or skid, that cannot move in the base, and whose lowest point is near that of the
// wheels.
DOPPEL_API std::vector<RollingPart> fit_rolling_parts(const Model& model, const Eigen::VectorXd& q0,
                                                      LinkShapes& shapes);

}  // namespace doppel
