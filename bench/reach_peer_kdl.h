#pragma once
// A chain as KDL has it: each joint turns about the z of its segment, or slides along it.

#include <kdl/chain.hpp>
#include <kdl/frames.hpp>
#include <kdl/jntarray.hpp>

#include "reach_peers.h"

namespace doppel::bench {

inline KDL::Frame kdl_frame(const Pose& X) {
  const auto& R = X.linear();
  const Eigen::Vector3d p = X.translation();
  return {KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
          KDL::Vector(p.x(), p.y(), p.z())};
}

struct KdlArm {
  KDL::Chain chain;
  KDL::JntArray lower, upper;  // `unlimited` where the chain has none
};

// nullopt: the chain has mimic joints, which KDL cannot tie.
inline std::optional<KdlArm> kdl_arm(const Chain& chain, double unlimited) {
  if (!chain.direct) return std::nullopt;
  KdlArm out;
  out.chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), kdl_frame(chain.joints.front().X_PZ)));
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    const Pose& next = i + 1 < chain.joints.size() ? chain.joints[i + 1].X_PZ : chain.X_ZT;
    const auto type = chain.joints[i].prismatic ? KDL::Joint::TransZ : KDL::Joint::RotZ;
    out.chain.addSegment(KDL::Segment(KDL::Joint(type), kdl_frame(next)));
  }
  const auto n = static_cast<unsigned>(chain.size());
  out.lower.resize(n);
  out.upper.resize(n);
  for (unsigned v = 0; v < n; ++v) {
    out.lower(v) = std::max(chain.lower[v], -unlimited);
    out.upper(v) = std::min(chain.upper[v], unlimited);
  }
  return out;
}

}  // namespace doppel::bench
