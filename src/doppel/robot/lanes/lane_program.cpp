#include "doppel/robot/lanes/lane_program.h"

namespace doppel {

void to_numbers(const Pose& X, double* out) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out[row * 3 + column] = X.linear()(row, column);
    out[9 + row] = X.translation()[row];
  }
}

LaneProgram::LaneProgram(const Chain& chain)
    : lower_(chain.lower.begin(), chain.lower.end()),
      upper_(chain.upper.begin(), chain.upper.end()),
      no_lower_(lower_.size(), -kInfinity),
      no_upper_(upper_.size(), kInfinity) {
  for (const ChainJoint& joint : chain.joints) {
    LaneJoint out{};
    to_numbers(joint.X_PZ, out.X_PZ);
    out.multiplier = joint.multiplier;
    out.offset = joint.offset;
    out.variable = joint.variable;
    out.prismatic = joint.prismatic;
    joints_.push_back(out);
  }
  chain_.joints = joints_.data();
  chain_.joint_count = static_cast<int>(joints_.size());
  chain_.variable_count = chain.size();
  chain_.direct = chain.direct;
  to_numbers(chain.X_ZT, chain_.X_ZT);
  free_ = chain_;
  chain_.lower = lower_.data();
  chain_.upper = upper_.data();
  free_.lower = no_lower_.data();
  free_.upper = no_upper_.data();
}

}  // namespace doppel
