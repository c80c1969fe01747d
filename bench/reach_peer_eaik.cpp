#include <eaik/EAIK.h>

#include "reach_peers.h"

namespace doppel::bench {
namespace {

class Eaik : public IkPeer {
 public:
  Eaik(const Eigen::MatrixXd& axes, const Eigen::MatrixXd& offsets, const Eigen::Matrix3d& R)
      : robot_(axes, offsets, R) {}

  [[nodiscard]] bool can() const { return robot_.has_known_decomposition(); }
  [[nodiscard]] std::string name() const override { return "EAIK, " + robot_.get_kinematic_family(); }

  bool solve(const Pose& X_BT, const Eigen::VectorXd&, std::vector<Eigen::VectorXd>& out) override {
    const IKS::IK_Solution found = robot_.calculate_IK(X_BT.matrix());
    bool any = false;
    for (std::size_t i = 0; i < found.Q.size(); ++i) {
      // The others are the nearest to a pose out of reach.
      any = any || !found.is_LS_vec[i];
      out.emplace_back(
          Eigen::Map<const Eigen::VectorXd>(found.Q[i].data(), static_cast<Eigen::Index>(found.Q[i].size())));
    }
    return any;
  }

 private:
  EAIK::Robot robot_;
};

}  // namespace

void add_eaik_peer(const Chain& chain, IkPeers& out, std::vector<std::string>& notes) {
  const auto count = static_cast<Eigen::Index>(chain.joints.size());
  bool turns = chain.direct;
  for (const ChainJoint& joint : chain.joints) turns = turns && !joint.prismatic;
  if (!turns || count > 6) {
    notes.emplace_back(count > 6 ? "EAIK: not with more than six joints"
                                 : "EAIK: not with mimic or prismatic joints");
    return;
  }
  Eigen::MatrixXd axes(3, count), offsets(3, count + 1);
  Pose X_BZ = Pose::Identity();
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < count; ++i) {
    X_BZ = X_BZ * chain.joints[static_cast<std::size_t>(i)].X_PZ;
    axes.col(i) = X_BZ.linear().col(2);
    offsets.col(i) = X_BZ.translation() - before;
    before = X_BZ.translation();
  }
  const Pose X_BT = X_BZ * chain.X_ZT;
  offsets.col(count) = X_BT.translation() - before;
  try {
    auto peer = std::make_unique<Eaik>(axes, offsets, X_BT.linear());
    if (peer->can()) {
      out.push_back(std::move(peer));
      return;
    }
    notes.emplace_back("EAIK: has no decomposition for this arm");
  } catch (const std::exception& error) {
    notes.emplace_back(std::string("EAIK: ") + error.what());
  }
}

}  // namespace doppel::bench
