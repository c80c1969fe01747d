#pragma once
// The parts of a robot that roll and slide on the ground, for the start's notes and for programs: its wheels and
// casters, the load on each, and the track of a base with two driven wheels.

#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

struct RollingLoad {
  RollingPart part;
  std::string link;
  double load = 0;  // N, force of the ground along its normal at rest
};

struct RollingReport {
  std::vector<RollingLoad> parts;  // in the order of ModelInstance::rolling
  // m, of two wheels on one axis: the distance of their points of contact, and the track by which encoders give
  // the heading when the base turns on the spot. Torsion of the contacts (friction.h) widens it by the factor
  // 1 + (2 mu_t / (mu track))^2.
  std::optional<double> track, effective_track;
  bool diverged = false;  // before the robot stood: the loads are not known
};

// Steps a copy of the engine with all joints held until the robot stands. Empty without wheels. Allocates; any
// thread that may read the engine.
[[nodiscard]] DOPPEL_API RollingReport report_rolling(const Instance& robot);

// "rolls on 'left_wheel' and 'right_wheel' (radius 0.098 m, 34 N each), track 0.33 m; 'ball' slides (friction
// 0.05, 20 N)".
[[nodiscard]] DOPPEL_API std::string to_string(const RollingReport& report);

}  // namespace doppel
