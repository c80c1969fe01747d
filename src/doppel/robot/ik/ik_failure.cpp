#include "doppel/robot/ik/ik_failure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/math/units.h"

namespace doppel {
namespace {

bool prismatic(const Chain& chain, int variable) {
  return std::any_of(chain.joints.begin(), chain.joints.end(),
                     [variable](const ChainJoint& j) { return j.variable == variable && j.prismatic; });
}

// Whole turns are taken off first, so that what is left is the least that the joint lacks.
LimitExcess excess_of(const Chain& chain, int variable, double value) {
  const double low = chain.lower[variable], high = chain.upper[variable];
  LimitExcess best{variable, value, value, 0};
  if (value >= low && value <= high) return best;
  best.excess = kInfinity;
  const int turns = chain.turns[static_cast<std::size_t>(variable)] ? 2 : 0;
  for (int k = -turns; k <= turns; ++k) {
    const double turned = value + 2 * M_PI * k;
    const double limit = std::clamp(turned, low, high);
    if (std::abs(turned - limit) < best.excess) best = {variable, turned, limit, std::abs(turned - limit)};
  }
  return best;
}

// The least excess of all branches without limits.
std::vector<LimitExcess> least_excess(const IkSolver& arm, const std::vector<IkSolution>& solutions) {
  std::vector<LimitExcess> best;
  double least = kInfinity;
  for (const IkSolution& solution : solutions) {
    std::vector<LimitExcess> excesses;
    double total = 0;
    for (int v = 0; v < arm.chain().size(); ++v) {
      const LimitExcess excess = excess_of(arm.chain(), v, solution.u[v]);
      total += excess.excess;
      if (excess.excess > 0) excesses.push_back(excess);
    }
    if (total >= least) continue;
    least = total;
    best = std::move(excesses);
  }
  return best;
}

std::string amount(double value, bool length) {
  if (!length) return fmt::format("{:.3g} deg", value / kDegree);
  return value < 1 ? fmt::format("{:.3g} mm", value * 1e3) : fmt::format("{:.3g} m", value);
}

std::string describe_limits(const IkSolver& arm, const std::vector<LimitExcess>& limits) {
  std::string out;
  for (const LimitExcess& limit : limits) {
    const bool length = prismatic(arm.chain(), limit.variable);
    if (!out.empty()) out += " and ";
    out +=
        fmt::format("'{}' would have to {} {} beyond its {} limit of {}", variable_name(arm, limit.variable),
                    length ? "move" : "turn", amount(limit.excess, length),
                    limit.value > limit.limit ? "upper" : "lower", amount(limit.limit, length));
  }
  return out;
}

}  // namespace

const std::string& variable_name(const IkSolver& arm, int variable) {
  const int joint = arm.chain().variables[static_cast<std::size_t>(variable)];
  return arm.model().joints[static_cast<std::size_t>(joint)].name;
}

IkFailure explain(const IkSolver& arm, const IkRequest& request) {
  IkFailure out;
  out.nearest = arm.nearest(request);
  IkRequest any = request;
  any.accepts = {};
  if (request.accepts) {
    out.refused = arm.solve_all(any);
    if (!out.refused.empty()) {
      out.obstacle = IkObstacle::refused;
      return out;
    }
  }
  out.limits = least_excess(arm, arm.solve_without_limits(any));
  if (!out.limits.empty()) {
    out.obstacle = IkObstacle::limits;
    return out;
  }
  IkRequest position = any;
  position.task = IkTask::position;
  out.obstacle = arm.solve(position) ? IkObstacle::rotation : IkObstacle::out_of_reach;
  return out;
}

std::string describe(const IkSolver& arm, const IkRequest& request, const IkFailure& failure) {
  switch (failure.obstacle) {
    case IkObstacle::out_of_reach:
      return fmt::format("the position is out of reach by {}", amount(failure.nearest.position_error, true));
    case IkObstacle::rotation: {
      const double left =
          request.task == IkTask::pose ? failure.nearest.free_rotation : failure.nearest.rotation_error;
      return fmt::format("the position can be reached, but only with another rotation, {} away",
                         amount(left, false));
    }
    case IkObstacle::limits:
      return describe_limits(arm, failure.limits);
    case IkObstacle::refused:
      break;
  }
  return fmt::format("none of the {} solution{} is accepted", failure.refused.size(),
                     failure.refused.size() == 1 ? "" : "s");
}

}  // namespace doppel
