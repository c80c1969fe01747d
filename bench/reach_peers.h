#pragma once
// Other solvers of inverse kinematics, on the chains of bench_reach. Each has a source of its own, because it
// is built only where its library is found.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/robot/lanes/chain.h"

namespace doppel::bench {

inline constexpr double kPeerSeconds = 0.005;  // that a search may take, as MoveIt and TRAC-IK set it
inline constexpr double kPeerTolerance = 1e-5;

class IkPeer {
 public:
  virtual ~IkPeer() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  // Appends configurations for the pose; `seed` is the middle of the limits. True: it calls one a solution.
  virtual bool solve(const Pose& X_BT, const Eigen::VectorXd& seed, std::vector<Eigen::VectorXd>& out) = 0;
};

using IkPeers = std::vector<std::unique_ptr<IkPeer>>;

// A peer that cannot solve the chain is skipped, with a sentence in `notes`.
void add_kdl_peers(const Chain& chain, IkPeers& out, std::vector<std::string>& notes);
void add_trac_ik_peer(const Chain& chain, IkPeers& out, std::vector<std::string>& notes);
void add_eaik_peer(const Chain& chain, IkPeers& out, std::vector<std::string>& notes);

}  // namespace doppel::bench
