#pragma once
// The lowest point of all shapes of a robot.

#include <algorithm>
#include <cstddef>

#include "doppel/robot/collision/link_shapes.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// z, m, in the frame of the poses; kInfinity: there is no shape. `pose_of(link)`: of a link that has shapes.
template <class PoseOf>
double lowest_point(const LinkShapes& shapes, PoseOf pose_of) {
  double out = kInfinity;
  for (std::size_t link = 0; link < shapes.size(); ++link) {
    if (shapes[link].empty()) continue;
    const Pose X_FL = pose_of(link);
    for (const CollisionShape& shape : shapes[link])
      out = std::min(out, lowest_point(shape, X_FL * shape.X_LS));
  }
  return out;
}

}  // namespace doppel
