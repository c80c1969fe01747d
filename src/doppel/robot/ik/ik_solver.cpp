#include "doppel/robot/ik/ik_solver.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "doppel/robot/ik/detail/solver_impl.h"
#include "doppel/robot/ik/detail/starts.h"

namespace doppel {
namespace {

constexpr int kIterations = 16;
constexpr int kFirstAttempts = kLaneCount - 1;  // beside the seed, so that the lanes are full
// The search ends well below the tolerance that is proven, so that rounding does not decide.
constexpr double kSearchTolerance = 1e-9;
// The kernels measure a rotation by 2 sin(angle / 2), which is a little smaller than the angle.
constexpr double kInsideTolerance = 0.99;
constexpr double kAlongReference = 1e-3;  // rad
constexpr double kSameBranch = 1e-4;      // rad or m
// A search within wide tolerances leaves less than a tenth of a millimetre of the position by this weight.
constexpr double kWithinTolerance = 0.01;

// The Frobenius norm of the difference of two rotations is 2 sqrt(2) sin(angle / 2).
double rotation_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return 2 * std::asin(std::min(1.0, (a - b).norm() / (2 * M_SQRT2)));
}

double angle_between_axes(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

// Moves each turning variable by whole turns to the value within the limits that is nearest to the seed's.
// False: there is none within the limits and the slack.
bool IkSolver::Impl::place(Eigen::VectorXd& u, const Eigen::VectorXd& seed, double slack) const {
  constexpr double kTurn = 2 * M_PI;
  for (int v = 0; v < chain.size(); ++v) {
    const double low = chain.lower[v] - slack, high = chain.upper[v] + slack;
    if (chain.turns[static_cast<std::size_t>(v)]) {
      double value = u[v] + kTurn * std::round((seed[v] - u[v]) / kTurn);
      if (value > high) value -= kTurn * std::ceil((value - high) / kTurn);
      if (value < low) value += kTurn * std::ceil((low - value) / kTurn);
      u[v] = value;
    }
    if (u[v] < low || u[v] > high) return false;
    u[v] = std::clamp(u[v], chain.lower[v], chain.upper[v]);
  }
  return true;
}

Eigen::VectorXd IkSolver::Impl::seed_of(const IkRequest& request) const {
  Eigen::VectorXd seed(chain.size());
  for (int v = 0; v < chain.size(); ++v) {
    const StartRange range = start_range(chain, v);
    const double middle = 0.5 * (range.low + range.high);
    seed[v] = request.seed.size() == chain.size() ? request.seed[v] : middle;
    seed[v] = std::clamp(seed[v], chain.lower[v], chain.upper[v]);
  }
  return seed;
}

LaneSearch IkSolver::Impl::search_of(const IkRequest& request, bool wide) const {
  LaneSearch out{};
  out.chain = &program.chain();
  out.task = request.task;
  // Along the reference axis, the angle to it is met only by the axis itself.
  const Eigen::Vector3d tool = request.X_BT.linear() * space.tool_axis;
  if (out.task == IkTask::angle && tool.cross(space.reference_axis).norm() < kAlongReference)
    out.task = IkTask::axis;
  for (int i = 0; i < 3; ++i) {
    out.tool_axis[i] = space.tool_axis[i];
    out.reference_axis[i] = space.reference_axis[i];
  }
  out.target_count = 1;
  out.max_iterations = kIterations;
  const double most = wide ? kInfinity : kSearchTolerance;
  out.position_tolerance = std::min(most, request.position_tolerance * kInsideTolerance);
  out.rotation_tolerance = std::min(most, request.rotation_tolerance * kInsideTolerance);
  out.length = std::max(chain.length, 1e-6);
  out.rotation_weight = wide ? kWithinTolerance : 1;
  return out;
}

IkSolution IkSolver::Impl::measured(const IkRequest& request, const Eigen::VectorXd& u) const {
  IkSolution out;
  out.u = u;
  out.X_BT = tip_pose(chain, u);
  out.position_error = (out.X_BT.translation() - request.X_BT.translation()).norm();
  out.free_rotation = rotation_between(out.X_BT.linear(), request.X_BT.linear());
  const Eigen::Vector3d a = out.X_BT.linear() * space.tool_axis, b = request.X_BT.linear() * space.tool_axis;
  const Eigen::Vector3d& reference = space.reference_axis;
  switch (request.task) {
    case IkTask::pose:
      out.rotation_error = out.free_rotation;
      break;
    case IkTask::axis:
      out.rotation_error = angle_between_axes(a, b);
      break;
    case IkTask::angle:
      out.rotation_error = std::abs(angle_between_axes(a, reference) - angle_between_axes(b, reference));
      break;
    case IkTask::position:
      break;
  }
  return out;
}

bool IkSolver::Impl::proven(const IkRequest& request, const IkSolution& solution) const {
  return solution.position_error <= request.position_tolerance &&
         solution.rotation_error <= request.rotation_tolerance;
}

bool IkSolver::Impl::contains(const std::vector<IkSolution>& solutions, const Eigen::VectorXd& u) {
  return std::any_of(solutions.begin(), solutions.end(), [&u](const IkSolution& other) {
    return (other.u - u).lpNorm<Eigen::Infinity>() < kSameBranch;
  });
}

// Adds a configuration that a search has found, if it is one, and is not there yet.
void IkSolver::Impl::keep(const IkRequest& request, const Eigen::VectorXd& seed, const double* u,
                          bool limited, std::vector<IkSolution>& out) const {
  Eigen::VectorXd placed = Eigen::Map<const Eigen::VectorXd>(u, chain.size());
  if (limited && !place(placed, seed, 0)) return;
  if (contains(out, placed)) return;
  IkSolution solution = measured(request, placed);
  if (!proven(request, solution)) return;
  solution.distance = (placed - seed).norm();
  out.push_back(std::move(solution));
}

void IkSolver::Impl::run(LaneSearch& search, const IkRequest& request, const Eigen::VectorXd& seed,
                         const double* starts_of_search, std::size_t count, bool limited,
                         std::vector<IkSolution>& out) const {
  const auto n = static_cast<std::size_t>(chain.size());
  const std::size_t attempts = count + (search.seeds != nullptr ? 1 : 0);
  const std::size_t results = search.every_attempt ? attempts : 1;
  double target[12];
  to_numbers(request.X_BT, target);
  std::vector<double> found(results * n);
  std::vector<int> attempt(results);
  search.targets = target;
  search.starts = starts_of_search;
  search.start_count = static_cast<int>(count);
  search.q = found.data();
  search.attempt = attempt.data();
  if (!limited) search.chain = &program.free_chain();
  kernels.search(search);
  for (std::size_t i = 0; i < results; ++i) {
    if (attempt[i] >= 0) keep(request, seed, &found[i * n], limited, out);
  }
}

// Attempts from the seed (if first is 0) and from starting points, all to their end.
void IkSolver::Impl::attempts(const IkRequest& request, const Eigen::VectorXd& seed, int first, int count,
                              bool limited, std::vector<IkSolution>& out, bool wide) const {
  LaneSearch search = search_of(request, wide);
  search.seeds = first == 0 ? seed.data() : nullptr;
  search.every_attempt = true;
  run(search, request, seed, start_at(first), static_cast<std::size_t>(count), limited, out);
}

// The first solution of further starting points.
std::optional<IkSolution> IkSolver::Impl::search(const IkRequest& request,
                                                 const Eigen::VectorXd& seed) const {
  const int count = std::min(request.attempts, kIkAttempts) - kFirstAttempts;
  if (count <= 0) return std::nullopt;
  LaneSearch search = search_of(request);
  std::vector<IkSolution> out;
  run(search, request, seed, start_at(kFirstAttempts), static_cast<std::size_t>(count), true, out);
  return out.empty() ? std::nullopt : std::optional(std::move(out.front()));
}

IkSolver::IkSolver(std::shared_ptr<const Model> model, Chain chain)
    : impl_(std::make_unique<Impl>(std::move(model), std::move(chain))) {}
IkSolver::~IkSolver() = default;
IkSolver::IkSolver(IkSolver&&) noexcept = default;

const Model& IkSolver::model() const {
  return *impl_->model;
}
const Chain& IkSolver::chain() const {
  return impl_->chain;
}
const TaskSpace& IkSolver::task_space() const {
  return impl_->space;
}
void IkSolver::set_tool_axis(const Eigen::Vector3d& axis) {
  impl_->space.tool_axis = axis.normalized();
}

IkMethod IkSolver::method() const {
  if (!impl_->way) return IkMethod::numeric;
  return impl_->is_exact() ? IkMethod::exact : IkMethod::nearly_exact;
}

std::string IkSolver::about_method() const {
  if (!impl_->way) return "search";
  const AnalyticWay& way = *impl_->way;
  std::string out;
  if (way.held >= 0) {
    const int joint = impl_->chain.variables[static_cast<std::size_t>(way.held)];
    out = fmt::format("sub-problems for each position of '{}'",
                      impl_->model->joints[static_cast<std::size_t>(joint)].name);
  } else if (way.arm->kind() == ArmKind::spherical_wrist) {
    out = way.arm->reversed() ? "spherical shoulder" : "spherical wrist";
  } else {
    out = way.arm->reversed() ? "parallel axes 3, 4, 5" : "parallel axes 2, 3, 4";
  }
  if (method() == IkMethod::nearly_exact)
    out += fmt::format(", axes off by up to {:.2g} mm or mrad", way.misfit * 1e3);
  return out;
}

namespace {

void sort_by_distance(std::vector<IkSolution>& solutions) {
  std::stable_sort(solutions.begin(), solutions.end(),
                   [](const IkSolution& a, const IkSolution& b) { return a.distance < b.distance; });
}

// True if the request has wider tolerances than a pose that is met.
bool is_wide(const IkRequest& request) {
  return request.position_tolerance > kIkPositionTolerance ||
         request.rotation_tolerance > kIkRotationTolerance;
}

std::optional<IkSolution> first_accepted(const IkRequest& request, std::vector<IkSolution>& solutions) {
  sort_by_distance(solutions);
  for (IkSolution& solution : solutions) {
    if (!request.accepts || request.accepts(solution.u)) return std::move(solution);
  }
  return std::nullopt;
}

}  // namespace

std::optional<IkSolution> IkSolver::solve(const IkRequest& request) const {
  const Eigen::VectorXd seed = impl_->seed_of(request);
  std::vector<IkSolution> found;
  // A pose by sub-problems has few solutions, and they are all there. Of a smaller task, and of seven
  // joints, there are infinitely many.
  const bool few = impl_->way && impl_->way->held < 0 && request.task == IkTask::pose;
  if (few && impl_->is_exact()) {
    if (auto out = impl_->nearest_exact_branch(request, seed)) return out;
  } else if (few) {
    impl_->branches(request, seed, true, false, found);
    if (auto out = first_accepted(request, found)) return out;
  }
  if (request.attempts == 0) return std::nullopt;
  found.clear();
  impl_->attempts(request, seed, 0, kFirstAttempts, true, found);
  if (auto out = first_accepted(request, found)) return out;
  if (!request.accepts) {
    if (auto out = impl_->search(request, seed)) return out;
  } else {
    found.clear();
    impl_->attempts(request, seed, kFirstAttempts, std::min(request.attempts, kIkBranchAttempts), true,
                    found);
    if (auto out = first_accepted(request, found)) return out;
  }
  if (!is_wide(request)) return std::nullopt;
  found.clear();
  impl_->attempts(request, seed, 0, std::min(request.attempts, kIkBranchAttempts), true, found, true);
  return first_accepted(request, found);
}

std::vector<IkSolution> IkSolver::solve_all(const IkRequest& request) const {
  const Eigen::VectorXd seed = impl_->seed_of(request);
  std::vector<IkSolution> found;
  // Two branches of a nearly exact arm may start so near to each other that they are refined to the same one.
  const bool complete = impl_->is_exact() && impl_->way->held < 0 && request.task == IkTask::pose;
  if (impl_->way && request.task == IkTask::pose) impl_->branches(request, seed, true, true, found);
  if (!complete || found.empty()) impl_->attempts(request, seed, 0, kIkBranchAttempts, true, found);
  if (request.accepts)
    std::erase_if(found, [&request](const IkSolution& s) { return !request.accepts(s.u); });
  sort_by_distance(found);
  return found;
}

std::vector<IkSolution> IkSolver::solve_without_limits(const IkRequest& request) const {
  const Eigen::VectorXd seed = impl_->seed_of(request);
  std::vector<IkSolution> found;
  if (impl_->way && request.task == IkTask::pose) impl_->branches(request, seed, false, true, found);
  if (found.empty()) impl_->attempts(request, seed, 0, kIkBranchAttempts, false, found);
  sort_by_distance(found);
  return found;
}

void IkSolver::solve_batch(std::span<const Pose> targets, const IkRequest& common,
                           std::span<const double> seeds,
                           std::vector<std::optional<Eigen::VectorXd>>& found) const {
  const Chain& chain = impl_->chain;
  const auto n = static_cast<std::size_t>(chain.size());
  std::vector<double> numbers(targets.size() * 12), q(targets.size() * n);
  std::vector<int> attempt(targets.size());
  for (std::size_t i = 0; i < targets.size(); ++i) to_numbers(targets[i], &numbers[i * 12]);
  IkRequest request = common;
  LaneSearch search = impl_->search_of(request, is_wide(common));
  search.targets = numbers.data();
  search.target_count = static_cast<int>(targets.size());
  search.seeds = seeds.empty() ? nullptr : seeds.data();
  search.starts = impl_->starts.data();
  search.start_count = std::min(common.attempts, kIkAttempts);
  search.q = q.data();
  search.attempt = attempt.data();
  impl_->kernels.search(search);
  found.assign(targets.size(), std::nullopt);
  const Eigen::VectorXd middle = impl_->seed_of(request);
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (attempt[i] < 0) continue;
    Eigen::VectorXd u = Eigen::Map<const Eigen::VectorXd>(&q[i * n], chain.size());
    const Eigen::VectorXd seed =
        seeds.empty() ? middle
                      : Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(&seeds[i * n], chain.size()));
    request.X_BT = targets[i];
    if (impl_->place(u, seed, 0) && impl_->proven(request, impl_->measured(request, u)))
      found[i] = std::move(u);
  }
}

IkSolution IkSolver::measured(const IkRequest& request, const Eigen::VectorXd& u) const {
  return impl_->measured(request, u);
}

}  // namespace doppel
