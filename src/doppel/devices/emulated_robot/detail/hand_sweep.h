#pragma once
// The motion of a person who moves each joint through its whole range, as a calibration asks for: all joints
// stand in the middle of their ranges for a while, then one after the other goes to its lower limit, to its
// upper one and back; again and again.

#include <span>
#include <vector>

#include "doppel/devices/drivers/servo_setup.h"

namespace doppel {

class HandSweep {
 public:
  explicit HandSweep(const std::vector<JointServo>& joints);

  // Positions of the joints, rad or m, `time` seconds after the start.
  void positions(double time, std::span<double> out) const;

 private:
  struct Range {
    double middle = 0, half = 0;
    double begin = 0, quarter = 0;  // s: when its turn begins, and how long it takes to a limit
  };
  std::vector<Range> ranges_;
  double period_ = 0;  // s
};

}  // namespace doppel
