#pragma once
// The load of a joint's loop: its inertia over the configurations of the machine, friction and gravity.

#include <vector>

#include "doppel/export.h"
#include "doppel/validation/checks/subject.h"
#include "doppel/validation/checks/suite.h"

namespace doppel {

struct PlantLoad {
  double least_inertia = 0, most_inertia = 0;  // kg m^2 or kg
  double gravity = 0;                          // N m or N: the largest load at rest
  double damping = 0, friction = 0;            // with those of its mimics
};

inline constexpr int kLoadConfigurations = 2000;

// The loads [joints] of Subject::model, with and without the suite's payload; 0 for joints without a drive.
// The least inertia is that of the joint while all others are free, the most that while they are held.
DOPPEL_API std::vector<PlantLoad> joint_loads(const Subject& subject, const ToolLoad& tool,
                                              int configurations = kLoadConfigurations);

// The inertia of a joint at one configuration, while the others are held.
DOPPEL_API double inertia_at(const Model& model, const Eigen::VectorXd& q, int joint);

}  // namespace doppel
