#pragma once
// Forward kinematics of a chain in lanes.

#include "doppel/robot/lanes/kernels/lanes.h"
#include "doppel/robot/lanes/lane_kernels.h"

namespace {

using doppel::kMaxChainJoints;
using doppel::kMaxChainVariables;

// The axis of a joint and a point of it, in the base.
struct LaneAxis {
  Lane3 z, p;
};

// The twelve numbers of a pose in their order (lane_kernels.h).
struct PoseNumbers {
  Lane* number[12];
};
DOPPEL_LANES PoseNumbers numbers_of(LanePose& X) {
  return {{&X.x.x, &X.y.x, &X.z.x, &X.x.y, &X.y.y, &X.z.y, &X.x.z, &X.y.z, &X.z.z, &X.p.x, &X.p.y, &X.p.z}};
}

DOPPEL_LANES LanePose identity_pose() {
  const Lane zero = broadcast(0), one = broadcast(1);
  return {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}, {zero, zero, zero}};
}

// X * C, where C is constant.
DOPPEL_LANES LanePose times(const LanePose& X, const double* C) {
  LanePose out;
  out.x = X.x * broadcast(C[0]) + X.y * broadcast(C[3]) + X.z * broadcast(C[6]);
  out.y = X.x * broadcast(C[1]) + X.y * broadcast(C[4]) + X.z * broadcast(C[7]);
  out.z = X.x * broadcast(C[2]) + X.y * broadcast(C[5]) + X.z * broadcast(C[8]);
  out.p = X.p + X.x * broadcast(C[9]) + X.y * broadcast(C[10]) + X.z * broadcast(C[11]);
  return out;
}

// Moves by one joint at position q, and returns its axis.
DOPPEL_LANES LaneAxis move_by(const doppel::LaneJoint& joint, const Lane& q, LanePose& X) {
  X = times(X, joint.X_PZ);
  const LaneAxis axis{X.z, X.p};
  if (joint.prismatic) {
    X.p = X.p + X.z * q;
    return axis;
  }
  Lane s, c;
  sine_cosine(q, s, c);
  const Lane3 x = X.x, y = X.y;
  X.x = x * c + y * s;
  X.y = y * c - x * s;
  return axis;
}

DOPPEL_LANES Lane position_of(const doppel::LaneJoint& joint, const Lane* u) {
  return u[joint.variable] * joint.multiplier + joint.offset;
}

}  // namespace
