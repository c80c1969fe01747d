#pragma once
// The verdicts of self-collision in random configurations of an arm, against those of FCL on the meshes.

#include <memory>

#include "doppel/robot/clearance/clearance.h"
#include "doppel/robot/reach/arm_reach.h"

namespace doppel::bench {

struct SweepCounts {
  int states = 0, touching = 0;  // by FCL
  // States that are called free and touch by FCL, and the reverse: by ArmReach and by Clearance.
  int free_wrong = 0, touching_wrong = 0, covers_free_wrong = 0, covers_touching_wrong = 0;
  std::string first;  // the pair of the first disagreement
  std::string often;  // the pair that is most often the first one to touch by FCL, and how often
};

// `scene` is that of `reach`, `covers` those of its instance 0. Throws InputError: a mesh cannot be read.
SweepCounts sweep(const RobotDescription& robot, const std::shared_ptr<const Model>& model, ArmReach& reach,
                  const std::shared_ptr<const CollisionScene>& scene,
                  const std::shared_ptr<const InstanceCovers>& covers, int states);

}  // namespace doppel::bench
