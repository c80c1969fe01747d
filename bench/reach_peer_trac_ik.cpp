#include <trac_ik/trac_ik.hpp>

#include "reach_peer_kdl.h"

namespace doppel::bench {
namespace {

constexpr double kUnlimited = 3.4e38;  // as TRAC-IK marks joints without limits

class TracIk : public IkPeer {
 public:
  explicit TracIk(const KdlArm& arm)
      : joints_(arm.chain.getNrOfJoints()),
        solver_(arm.chain, arm.lower, arm.upper, kPeerSeconds, kPeerTolerance, TRAC_IK::Speed) {}

  [[nodiscard]] std::string name() const override { return "TRAC-IK, 5 ms, two threads"; }

  bool solve(const Pose& X_BT, const Eigen::VectorXd& seed, std::vector<Eigen::VectorXd>& out) override {
    KDL::JntArray start(joints_), found(joints_);
    start.data = seed;
    if (solver_.CartToJnt(start, kdl_frame(X_BT), found) < 0) return false;
    out.push_back(found.data);
    return true;
  }

 private:
  unsigned joints_;
  TRAC_IK::TRAC_IK solver_;
};

}  // namespace

void add_trac_ik_peer(const Chain& chain, IkPeers& out, std::vector<std::string>& notes) {
  if (const auto arm = kdl_arm(chain, kUnlimited)) {
    out.push_back(std::make_unique<TracIk>(*arm));
  } else {
    notes.emplace_back("TRAC-IK: not with mimic joints");
  }
}

}  // namespace doppel::bench
