#include "reach_peer_kdl.h"

#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#include <kdl/chainiksolverpos_nr_jl.hpp>
#include <kdl/chainiksolvervel_pinv.hpp>
#include <random>

#include "reach_robots.h"

namespace doppel::bench {
namespace {

constexpr unsigned kNewtonIterations = 500;  // of MoveIt's plugin
constexpr unsigned kRestartSeed = 1;

// MoveIt's default: Newton and Raphson within the limits, from random starts until the time is over.
class KdlNewton : public IkPeer {
 public:
  KdlNewton(KdlArm arm, double seconds)
      : arm_(std::move(arm)),
        seconds_(seconds),
        forward_(arm_.chain),
        velocity_(arm_.chain),
        solver_(arm_.chain, arm_.lower, arm_.upper, forward_, velocity_, kNewtonIterations, kPeerTolerance) {}

  [[nodiscard]] std::string name() const override {
    return seconds_ > 0 ? "KDL Newton, restarts for 5 ms" : "KDL Newton, once";
  }

  bool solve(const Pose& X_BT, const Eigen::VectorXd& seed, std::vector<Eigen::VectorXd>& out) override {
    const KDL::Frame target = kdl_frame(X_BT);
    const unsigned n = arm_.chain.getNrOfJoints();
    KDL::JntArray start(n), found(n);
    start.data = seed;
    const double end = clock_us() + seconds_ * 1e6;
    do {
      if (solver_.CartToJnt(start, target, found) >= 0) {
        out.push_back(found.data);
        return true;
      }
      for (unsigned v = 0; v < n; ++v)
        start(v) = std::uniform_real_distribution(arm_.lower(v), arm_.upper(v))(random_);
    } while (clock_us() < end);
    return false;
  }

 private:
  KdlArm arm_;
  double seconds_;
  KDL::ChainFkSolverPos_recursive forward_;
  KDL::ChainIkSolverVel_pinv velocity_;
  KDL::ChainIkSolverPos_NR_JL solver_;
  std::mt19937 random_{kRestartSeed};
};

class KdlMarquardt : public IkPeer {
 public:
  // By default, a rotation counts a hundredth of a metre a radian, which leaves more than the tolerance.
  explicit KdlMarquardt(KdlArm arm)
      : arm_(std::move(arm)), solver_(arm_.chain, Eigen::Matrix<double, 6, 1>::Ones(), kPeerTolerance) {}

  [[nodiscard]] std::string name() const override { return "KDL LMA, without limits"; }

  bool solve(const Pose& X_BT, const Eigen::VectorXd& seed, std::vector<Eigen::VectorXd>& out) override {
    KDL::JntArray start(arm_.chain.getNrOfJoints()), found(arm_.chain.getNrOfJoints());
    start.data = seed;
    if (solver_.CartToJnt(start, kdl_frame(X_BT), found) < 0) return false;
    out.push_back(found.data);
    return true;
  }

 private:
  KdlArm arm_;
  KDL::ChainIkSolverPos_LMA solver_;
};

}  // namespace

void add_kdl_peers(const Chain& chain, IkPeers& out, std::vector<std::string>& notes) {
  const auto arm = kdl_arm(chain, M_PI);
  if (!arm) {
    notes.emplace_back("KDL: not with mimic joints");
    return;
  }
  out.push_back(std::make_unique<KdlNewton>(*arm, 0));
  out.push_back(std::make_unique<KdlNewton>(*arm, kPeerSeconds));
  out.push_back(std::make_unique<KdlMarquardt>(*arm));
}

}  // namespace doppel::bench
