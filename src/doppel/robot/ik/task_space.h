#pragma once
// The task space of an arm: how many of the six numbers of a pose it can set, and along which axis its tool
// points.

#include <Eigen/Core>

#include "doppel/export.h"
#include "doppel/robot/lanes/chain.h"
#include "doppel/robot/lanes/lane_kernels.h"

namespace doppel {

struct TaskSpace {
  int freedom = 6;             // the numbers of a pose that the arm sets independently, at most 6
  IkTask task = IkTask::pose;  // the largest that fits
  Eigen::Vector3d tool_axis = Eigen::Vector3d::UnitZ();       // unit, in the tip: away from the arm
  Eigen::Vector3d reference_axis = Eigen::Vector3d::UnitZ();  // unit, in the base: of task angle
};

// The freedom is the rank of the Jacobian in configurations spread over the limits. The tool's axis is that
// of the last joint if the tip lies on it, else the direction from the last joint to the tip; in both cases
// the nearest axis of the tip's frame if it is within 5 degrees, and z where nothing else decides.
DOPPEL_API TaskSpace find_task_space(const Chain& chain);

// 6, 5, 4, 3.
DOPPEL_API int dimension(IkTask task);

}  // namespace doppel
