#include "doppel/export.h"
#include "doppel/robot/lanes/kernels/chain_lanes.h"
#include "doppel/robot/lanes/kernels/kernels.h"

namespace {

void tip_poses(const doppel::LaneChain& chain, const double* u, int count, double* poses) {
  for (int first = 0; first < count; first += kLanes) {
    const int lanes = count - first < kLanes ? count - first : kLanes;
    Lane q[kMaxChainVariables];
    for (int v = 0; v < chain.variable_count; ++v) {
      double values[kLanes] = {};
      for (int lane = 0; lane < lanes; ++lane) values[lane] = u[(first + lane) * chain.variable_count + v];
      q[v] = load(values);
    }
    LanePose X = identity_pose();
    for (int i = 0; i < chain.joint_count; ++i) move_by(chain.joints[i], position_of(chain.joints[i], q), X);
    X = times(X, chain.X_ZT);
    const PoseNumbers numbers = numbers_of(X);
    for (int k = 0; k < 12; ++k) {
      double values[kLanes];
      store(*numbers.number[k], values);
      for (int lane = 0; lane < lanes; ++lane) poses[(first + lane) * 12 + k] = values[lane];
    }
  }
}

}  // namespace

extern "C" DOPPEL_API const doppel::LaneKernels* doppel_lane_kernels() {
  static const doppel::LaneKernels kernels{doppel::search_lanes, tip_poses, doppel::clearance_in_8_lanes,
                                           doppel::clearance_in_16_lanes};
  return &kernels;
}
