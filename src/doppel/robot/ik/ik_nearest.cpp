// The nearest pose of an IkSolver.
#include <algorithm>
#include <cmath>

#include "doppel/robot/ik/detail/solver_impl.h"

namespace doppel {
namespace {

constexpr int kIterationsForNearest = 60, kAttemptsForNearest = 40;
// A position counts so much more than a rotation that what is left of it is below a millimetre, and is then
// removed.
constexpr double kPositionFirst = 0.02, kPositionOnly = 1e-3;
// The search beside refused configurations takes so many of them, and so many accepted ones.
constexpr std::size_t kAnchors = 4, kMaxRefused = 8;
constexpr int kHalvings = 10;
constexpr double kTurnScore = 0.1;  // of a rad, in lengths of the chain

}  // namespace

// The straight ways from accepted configurations to refused ones are followed as far as they are accepted;
// the end that comes nearest to the pose is the result.
std::optional<IkSolution> IkSolver::Impl::nearest_accepted(
    const IkRequest& request, const Eigen::VectorXd& seed,
    const std::vector<Eigen::VectorXd>& refused) const {
  std::vector<Eigen::VectorXd> anchors;
  if (request.accepts(seed)) anchors.push_back(seed);
  for (int k = 0; k < kIkBranchAttempts && anchors.size() < kAnchors; ++k) {
    const Eigen::VectorXd start = Eigen::Map<const Eigen::VectorXd>(start_at(k), chain.size());
    if (request.accepts(start)) anchors.push_back(start);
  }
  std::optional<IkSolution> best;
  double least = kInfinity;
  for (std::size_t i = 0; i < std::min<std::size_t>(refused.size(), kMaxRefused); ++i) {
    for (const Eigen::VectorXd& anchor : anchors) {
      double free = 0, blocked = 1;  // parts of the way
      for (int halving = 0; halving < kHalvings; ++halving) {
        const double middle = 0.5 * (free + blocked);
        (request.accepts(anchor + middle * (refused[i] - anchor)) ? free : blocked) = middle;
      }
      IkSolution stop = measured(request, anchor + free * (refused[i] - anchor));
      const double score =
          stop.position_error / std::max(chain.length, 1e-6) + kTurnScore * stop.rotation_error;
      if (score >= least) continue;
      least = score;
      best = std::move(stop);
    }
  }
  return best;
}

std::optional<IkSolution> IkSolver::Impl::nearest_found(const IkRequest& request, const Eigen::VectorXd& seed,
                                                        bool in_reach,
                                                        std::vector<Eigen::VectorXd>& refused) const {
  const auto n = static_cast<std::size_t>(chain.size());
  double target[12];
  to_numbers(request.X_BT, target);
  LaneSearch search = search_of(request);
  search.targets = target;
  search.seeds = seed.data();
  search.starts = starts.data();
  search.start_count = kAttemptsForNearest - 1;
  search.every_attempt = search.nearest = true;
  search.max_iterations = kIterationsForNearest;
  search.rotation_weight = in_reach ? kPositionFirst : kPositionOnly;
  std::vector<double> q(kAttemptsForNearest * n), residuals(kAttemptsForNearest * 2);
  std::vector<int> attempt(kAttemptsForNearest);
  search.q = q.data();
  search.residuals = residuals.data();
  search.attempt = attempt.data();
  kernels.search(search);
  std::optional<IkSolution> best;
  double best_score = kInfinity;
  for (std::size_t i = 0; i < kAttemptsForNearest; ++i) {
    Eigen::VectorXd u = Eigen::Map<const Eigen::VectorXd>(&q[i * n], chain.size());
    if (!place(u, seed, 0)) continue;
    const double score =
        std::hypot(residuals[i * 2] / search.length, search.rotation_weight * residuals[i * 2 + 1]);
    if (score > best_score - 1e-9) continue;
    if (request.accepts && !request.accepts(u)) {
      refused.push_back(std::move(u));
      continue;
    }
    best_score = score;
    best = measured(request, u);
  }
  return best;
}

IkSolution IkSolver::nearest(const IkRequest& request) const {
  const Eigen::VectorXd seed = impl_->seed_of(request);
  IkRequest position = request;
  position.task = IkTask::position;
  position.accepts = {};
  position.attempts = kIkBranchAttempts;
  const bool in_reach = solve(position).has_value();
  std::vector<Eigen::VectorXd> refused;
  std::optional<IkSolution> best = impl_->nearest_found(request, seed, in_reach, refused);
  // A pose beside the one that is asked for may be accepted where the nearest configurations are not.
  const bool is_met =
      best && best->position_error < kIkPositionTolerance && best->rotation_error < kIkRotationTolerance;
  if (!refused.empty() && !is_met) {
    auto beside = impl_->nearest_accepted(request, seed, refused);
    if (beside && (!best || beside->position_error < best->position_error)) {
      beside->distance = (beside->u - seed).norm();
      return *beside;
    }
  }
  if (!best) best = impl_->measured(request, seed);  // nothing is accepted
  if (in_reach) {
    position.seed = best->u;
    std::vector<IkSolution> found;
    impl_->attempts(position, best->u, 0, 0, true, found);
    if (!found.empty() && (!request.accepts || request.accepts(found.front().u)))
      best = impl_->measured(request, found.front().u);
  }
  best->distance = (best->u - seed).norm();
  return *best;
}

}  // namespace doppel
