// The branches of an IkSolver by sub-problems.
#include <algorithm>

#include "doppel/robot/ik/detail/solver_impl.h"
#include "doppel/robot/ik/detail/starts.h"

namespace doppel {
namespace {

constexpr int kRefineIterations = 12;
constexpr int kHeldPositions = 16;       // of the joint that is held in a chain of seven
constexpr double kNearArm = 0.02;        // of the chain's length
constexpr double kLimitSlack = 0.05;     // rad: the nearest exact arm's solution may be outside of the limits
constexpr double kRoundingSlack = 1e-7;  // rad
constexpr double kExactError = 1e-8;     // m and rad: a branch with more is refined

}  // namespace

void IkSolver::Impl::find_way() {
  const std::optional<ArmAxes> axes = axes_of(chain);
  if (!axes) return;
  const double tolerance = kNearArm * chain.length;
  if (axes->count < 7) {
    if (auto arm = AnalyticArm::find(*axes, tolerance)) way = {*axes, arm, -1, arm->misfit()};
    return;
  }
  // The joint in the middle first: holding it changes the pose of the arm the least. The arm must be of the
  // same kind wherever the joint is held.
  for (const int held : {2, 4, 3, 6, 0, 1, 5}) {
    double misfit = 0;
    bool fits = true;
    for (const double position : {0.3, 1.1, -0.7}) {
      const auto arm = AnalyticArm::find(held_at(*axes, held, position), tolerance);
      fits = fits && arm.has_value();
      if (arm) misfit = std::max(misfit, arm->misfit());
    }
    if (!fits || (way && way->misfit <= misfit)) continue;
    way = {*axes, std::nullopt, held, misfit};
  }
}

// The branches of the arm with six joints that remains when one is held; the held joint is inserted again.
void IkSolver::Impl::held_branches(const IkRequest& request, const Eigen::VectorXd& seed, bool sweep,
                                   std::vector<Branch>& out) const {
  const int held = way->held;
  const StartRange range = start_range(chain, held);
  Branch start{};
  for (int v = 0, i = 0; v < chain.size(); ++v) {
    if (v != held) start[static_cast<std::size_t>(i++)] = seed[v];
  }
  for (int k = 0; k <= (sweep ? kHeldPositions : 0); ++k) {
    const double position =
        k == 0 ? seed[held] : range.low + (range.high - range.low) * (k - 0.5) / kHeldPositions;
    const auto arm = AnalyticArm::find(held_at(way->axes, held, position), kNearArm * chain.length);
    if (!arm) continue;
    Branches found;
    arm->solve(request.X_BT, start, found);
    for (int i = 0; i < found.count; ++i) {
      Branch& branch = found.value[static_cast<std::size_t>(i)];
      for (int v = chain.size() - 1; v > held; --v)
        branch[static_cast<std::size_t>(v)] = branch[static_cast<std::size_t>(v - 1)];
      branch[static_cast<std::size_t>(held)] = position;
      out.push_back(branch);
    }
  }
}

void IkSolver::Impl::exact_branches(const IkRequest& request, const Eigen::VectorXd& seed, bool limited,
                                    std::vector<IkSolution>& out) const {
  Branch start{};
  std::copy(seed.begin(), seed.end(), start.begin());
  Branches found;
  way->arm->solve(request.X_BT, start, found);
  for (int i = 0; i < found.count; ++i) {
    IkSolution branch;
    branch.u =
        Eigen::Map<const Eigen::VectorXd>(found.value[static_cast<std::size_t>(i)].data(), chain.size());
    if ((limited && !place(branch.u, seed, kRoundingSlack)) || contains(out, branch.u)) continue;
    branch.distance = (branch.u - seed).norm();
    const auto behind =
        std::upper_bound(out.begin(), out.end(), branch.distance,
                         [](double distance, const IkSolution& other) { return distance < other.distance; });
    out.insert(behind, std::move(branch));
  }
}

void IkSolver::Impl::refine(const IkRequest& request, const Eigen::VectorXd& seed, const double* first,
                            std::size_t count, bool limited, std::vector<IkSolution>& out) const {
  LaneSearch search = search_of(request);
  search.max_iterations = kRefineIterations;
  search.every_attempt = true;
  run(search, request, seed, first, count, limited, out);
}

bool IkSolver::Impl::prove(const IkRequest& request, const Eigen::VectorXd& seed, bool limited,
                           IkSolution& branch) const {
  const double distance = branch.distance;
  branch = measured(request, branch.u);
  branch.distance = distance;
  if (branch.position_error <= kExactError && branch.rotation_error <= kExactError) return true;
  std::vector<IkSolution> refined;
  refine(request, seed, branch.u.data(), 1, limited, refined);
  if (refined.empty()) return proven(request, branch);
  branch = std::move(refined.front());
  return true;
}

std::optional<IkSolution> IkSolver::Impl::nearest_exact_branch(const IkRequest& request,
                                                               const Eigen::VectorXd& seed) const {
  std::vector<IkSolution> candidates;
  candidates.reserve(kMaxBranches);
  exact_branches(request, seed, true, candidates);
  for (IkSolution& branch : candidates) {
    if (prove(request, seed, true, branch) && (!request.accepts || request.accepts(branch.u)))
      return std::move(branch);
  }
  return std::nullopt;
}

// The branches by sub-problems. Those of an arm that is nearly exact are refined on the true arm, eight at
// once.
void IkSolver::Impl::branches(const IkRequest& request, const Eigen::VectorXd& seed, bool limited, bool sweep,
                              std::vector<IkSolution>& out) const {
  if (way->arm && is_exact()) {
    std::vector<IkSolution> candidates;
    candidates.reserve(kMaxBranches);
    exact_branches(request, seed, limited, candidates);
    for (IkSolution& branch : candidates) {
      if (prove(request, seed, limited, branch) && !contains(out, branch.u)) out.push_back(std::move(branch));
    }
    return;
  }
  std::vector<Branch> candidates;
  if (way->arm) {
    Branch start{};
    for (int v = 0; v < chain.size(); ++v) start[static_cast<std::size_t>(v)] = seed[v];
    Branches found;
    way->arm->solve(request.X_BT, start, found);
    candidates.assign(found.value.begin(), found.value.begin() + found.count);
  } else {
    held_branches(request, seed, sweep, candidates);
  }
  std::vector<double> first;  // [candidates][variables]
  for (const Branch& branch : candidates) {
    Eigen::VectorXd u = Eigen::Map<const Eigen::VectorXd>(branch.data(), chain.size());
    if (!limited || place(u, seed, kLimitSlack)) first.insert(first.end(), u.begin(), u.end());
  }
  // The seed itself too, which is in the branch that is asked for, where the nearest exact arm has lost it.
  if (limited && way->misfit > kExactArm) first.insert(first.end(), seed.begin(), seed.end());
  if (first.empty()) return;
  refine(request, seed, first.data(), first.size() / static_cast<std::size_t>(chain.size()), limited, out);
}

}  // namespace doppel
