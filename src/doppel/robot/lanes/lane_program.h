#pragma once
// A Chain in the numbers of the kernels, which stay where they are while kernels read them.

#include <array>
#include <vector>

#include "doppel/base/math/pose.h"
#include "doppel/export.h"
#include "doppel/robot/lanes/chain.h"
#include "doppel/robot/lanes/lane_kernels.h"

namespace doppel {

// Rotation by rows, then the origin.
DOPPEL_API void to_numbers(const Pose& X, double* out);

class DOPPEL_API LaneProgram {
 public:
  explicit LaneProgram(const Chain& chain);
  LaneProgram(const LaneProgram&) = delete;
  LaneProgram& operator=(const LaneProgram&) = delete;

  [[nodiscard]] const LaneChain& chain() const { return chain_; }
  // The same chain without limits.
  [[nodiscard]] const LaneChain& free_chain() const { return free_; }

 private:
  std::vector<LaneJoint> joints_;
  std::vector<double> lower_, upper_, no_lower_, no_upper_;
  LaneChain chain_{}, free_{};
};

}  // namespace doppel
