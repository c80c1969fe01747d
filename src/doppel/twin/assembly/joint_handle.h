#pragma once
// One scalar joint of a running robot, by its name. Valid until the robots of its twin change.

#include <cstddef>

#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

class DOPPEL_API JointHandle {
 public:
  JointHandle(Instance robot, int joint) : robot_(robot), joint_(joint) {}

  [[nodiscard]] double q() const;       // rad, m
  [[nodiscard]] double v() const;       // rad/s, m/s
  [[nodiscard]] double effort() const;  // N m, N: of the drive in the last step
  // The position (rad, m) that the drive holds from the next step on. A controller that commands the joint
  // overwrites it in its next tick. Throws InputError for a mimic joint, which has no drive.
  void command(double position);

 private:
  [[nodiscard]] const ModelJoint& model() const;

  Instance robot_;
  int joint_;
};

}  // namespace doppel
