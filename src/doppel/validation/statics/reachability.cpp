#include "doppel/validation/statics/reachability.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>

#include "doppel/base/core/parallel_work.h"
#include "doppel/base/math/units.h"
#include "doppel/description/meshes/convex_hull.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/robot/reach/arm_reach.h"
#include "doppel/robot/semantics/self_collision.h"
#include "doppel/validation/statics/detail/workspace_grid.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr double kPositionHit = 1e-4, kRotationHit = 1e-3;  // m, rad
constexpr double kGoalOfMany = 0.001,
                 kGoalOfFew = 0.005;  // missed; arms of six joints and more, and of fewer
constexpr double kMillisecond = 1e-3;

enum class Word { reached, other_orientation, limit, self_collision, too_far, too_near, missed };
constexpr std::array<const char*, 7> kWords = {"reached",
                                               "reached in another orientation only",
                                               "behind a limit",
                                               "in self-collision",
                                               "too far",
                                               "too near",
                                               "missed by the solver"};

using Arm = JudgedArm;

Pose tip_pose_at(const Arm& arm, Data& data, const Eigen::VectorXd& q) {
  forward_kinematics(*arm.model, data, q);
  return data.X_WL[static_cast<std::size_t>(arm.chain().tip_link)];
}

std::vector<Pose> poses_of(const Arm& arm, const std::vector<Eigen::VectorXd>& configurations) {
  Data data(*arm.model);
  std::vector<Pose> out;
  for (const Eigen::VectorXd& q : configurations) out.push_back(tip_pose_at(arm, data, q));
  return out;
}

struct Search {
  std::vector<char> found;      // [targets]
  std::vector<double> seconds;  // [targets] of wall-clock time
};

Search search(const CheckContext& context, const Arm& arm, const std::vector<Pose>& targets, double begin,
              double end) {
  Search out{std::vector<char>(targets.size(), 0), std::vector<double>(targets.size(), 0.0)};
  parallel_work(targets.size(), context.threads, [&] {
    return [&, reach = std::make_shared<ArmReach>(arm.reach())](std::size_t i) {
      const auto start = std::chrono::steady_clock::now();
      ReachQuery query;
      query.X_WT = targets[i];
      query.position_tolerance = kPositionHit;
      query.rotation_tolerance = kRotationHit;
      out.found[i] = reach->answer(query).solved ? 1 : 0;
      out.seconds[i] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      if (i % 32 == 0)
        context.report(begin + (end - begin) * static_cast<double>(i) / static_cast<double>(targets.size()));
    };
  });
  return out;
}

// -- the grid
std::vector<Eigen::Vector3d> directions(int count) {
  if (count == 6) return {{0, 0, -1}, {0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  return even_directions(count);
}

struct Grid {
  std::vector<Eigen::Vector3d> points;      // m, root link
  std::vector<Eigen::Vector3d> directions;  // of the tool; one for arms that cannot choose it
};

Grid grid_of(const CheckContext& context, const Arm& arm, bool has_direction) {
  int count = context.amount(6, 6, 26);
  if (context.suite.workspace) {
    count = context.suite.workspace->directions;
    if (context.effort == Effort::quick) count = std::min(count, 6);
  }
  return {workspace_grid(context, &arm, context.amount(3, 5, 10)).points,
          directions(has_direction ? count : 1)};
}

struct Judged {
  Word word = Word::reached;
  std::string detail;  // the joint, or the pair of links
};

Judged judge_failure(ArmReach& reach, const Arm& arm, const ReachQuery& query, const ReachAnswer& answer,
                     const Eigen::Vector3d& first_joint) {
  if (!answer.failure) return {Word::missed, ""};
  const IkFailure& failure = *answer.failure;
  switch (failure.obstacle) {
    case IkObstacle::rotation:
      return {Word::other_orientation, ""};
    case IkObstacle::limits:
      return {Word::limit,
              failure.limits.empty() ? "" : variable_name(reach.solver(), failure.limits.front().variable)};
    case IkObstacle::refused: {
      if (failure.refused.empty()) return {Word::self_collision, ""};
      Eigen::VectorXd q = arm.model->neutral();
      arm.chain().apply(*arm.model, failure.refused.front().u, q);
      const ReachBranch branch = reach.branch_at(q);
      return {Word::self_collision,
              branch.touching.empty() ? "" : branch.touching.front().a + " and " + branch.touching.front().b};
    }
    case IkObstacle::out_of_reach:
      break;
  }
  const Pose X_WB = reach.base_pose(arm.model->neutral());
  const double target = (query.X_WT.translation() - first_joint).norm();
  const double nearest = (X_WB * failure.nearest.X_BT.translation() - first_joint).norm();
  return {target > nearest ? Word::too_far : Word::too_near, ""};
}

// A pose that the solver calls impossible is tried again from the configurations that come nearest to it.
bool is_missed(ArmReach& reach, ReachQuery query, const std::vector<Pose>& reached,
               const std::vector<Eigen::VectorXd>& configurations) {
  constexpr double kNeighbour = 0.02;  // m
  for (std::size_t i = 0; i < reached.size(); ++i) {
    if ((reached[i].translation() - query.X_WT.translation()).norm() > kNeighbour) continue;
    query.q = configurations[i];
    if (reach.answer(query).solved) return true;
  }
  return false;
}

std::vector<Judged> judge_grid(const CheckContext& context, const Arm& arm, const Grid& grid, IkTask task,
                               const std::vector<Eigen::VectorXd>& configurations) {
  const std::size_t count = grid.points.size() * grid.directions.size();
  std::vector<Judged> out(count);
  const std::vector<Pose> reached = poses_of(arm, configurations);
  parallel_work(count, context.threads, [&] {
    return [&, reach = std::make_shared<ArmReach>(arm.reach())](std::size_t i) {
      ReachQuery query;
      const Eigen::Vector3d tool = reach->solver().task_space().tool_axis;
      query.X_WT.translation() = grid.points[i / grid.directions.size()];
      query.X_WT.linear() =
          Eigen::Quaterniond::FromTwoVectors(tool, grid.directions[i % grid.directions.size()])
              .toRotationMatrix();
      query.task = task;
      const ReachAnswer answer = reach->answer(query);
      if (!answer.solved) {
        const Eigen::Vector3d first =
            reach->base_pose(arm.model->neutral()) * arm.chain().joints.front().X_PZ.translation();
        out[i] = is_missed(*reach, query, reached, configurations)
                     ? Judged{Word::missed, ""}
                     : judge_failure(*reach, arm, query, answer, first);
      }
      if (i % 32 == 0) context.report(0.5 + 0.5 * static_cast<double>(i) / static_cast<double>(count));
    };
  });
  return out;
}

// "61 % reached, 22 % too far, 9 % behind a limit (elbow)".
std::string map_text(const std::vector<Judged>& judged) {
  std::map<Word, std::size_t> counts;
  std::map<Word, std::map<std::string, std::size_t>> details;
  for (const Judged& one : judged) {
    ++counts[one.word];
    if (!one.detail.empty()) ++details[one.word][one.detail];
  }
  std::string out;
  for (const auto& [word, count] : counts) {
    out += fmt::format("{}{:.0f} % {}", out.empty() ? "" : ", ",
                       100.0 * static_cast<double>(count) / static_cast<double>(judged.size()),
                       kWords[static_cast<std::size_t>(word)]);
    if (details[word].empty()) continue;
    const auto most =
        std::ranges::max_element(details[word], {}, [](const auto& entry) { return entry.second; });
    out += fmt::format(" (mostly {})", most->first);
  }
  return out;
}

const char* task_text(int joints) {
  if (joints >= 6) return "position and rotation";
  return joints == 5 ? "position and direction of the tool" : "position";
}

// The map of the workspace. Returns whether a place of it is reached, in any direction.
bool judge_workspace(const CheckContext& context, const Arm& arm,
                     const std::vector<Eigen::VectorXd>& configurations, CheckResult& out) {
  const std::string& name = arm.group->name;
  const bool has_direction = arm.chain().size() >= 5;
  const Grid grid = grid_of(context, arm, has_direction);
  const std::vector<Judged> judged =
      judge_grid(context, arm, grid, has_direction ? IkTask::axis : IkTask::position, configurations);
  const auto count = [&](Word word) {
    return static_cast<std::size_t>(std::ranges::count(judged, word, &Judged::word));
  };
  const std::size_t reached = count(Word::reached), lost = count(Word::missed);
  const auto all = static_cast<double>(judged.size());
  out.metrics.push_back({"workspace reached", name, 100 * static_cast<double>(reached) / all, "%",
                         std::nullopt, Metric::Better::higher});
  out.notes.push_back(fmt::format("{}: of {} places in {} directions {}", name, grid.points.size(),
                                  grid.directions.size(), map_text(judged)));
  if (static_cast<double>(lost) > context.suite.max_missed * all)
    out.fail(name, fmt::format("{} of {} poses of the grid are missed by the solver", lost, judged.size()));
  return reached + lost + count(Word::other_orientation) > 0;
}

// Returns whether it reaches a place of the workspace.
bool judge_arm(const CheckContext& context, const Arm& arm, CheckResult& out) {
  const int joints = arm.chain().size();
  const std::vector<Eigen::VectorXd> configurations =
      free_configurations(arm, context.amount(200, 1000, 10'000), context.seed);
  const std::string& name = arm.group->name;
  if (configurations.empty()) {
    out.fail(name, "no configuration within its limits is free of self-collision",
             "doppel view shows the links that overlap; see T3");
    return true;
  }
  const Search found = search(context, arm, poses_of(arm, configurations), 0, 0.5);
  const auto missed = static_cast<std::size_t>(std::ranges::count(found.found, 0));
  const double share = static_cast<double>(missed) / static_cast<double>(configurations.size());
  double seconds = 0;
  for (const double one : found.seconds) seconds += one;
  out.metrics.push_back({"missed", name, 100 * share, "%", 100 * context.suite.max_missed});
  out.metrics.push_back({"mean time", name,
                         seconds / static_cast<double>(configurations.size()) / kMillisecond, "ms",
                         std::nullopt, Metric::Better::lower, true});
  CheckItem item;
  item.subject = name;
  item.verdict = share > context.suite.max_missed ? Verdict::failed : Verdict::passed;
  item.message = fmt::format("{} of {} poses that it can reach are found ({}; at most {:.3g} % missed)",
                             configurations.size() - missed, configurations.size(), task_text(joints),
                             100 * context.suite.max_missed);
  if (missed > 0) {
    item.fix = "other limits or link lengths than meant, or an arm that the solver does not know: doppel ik";
    const auto first = std::ranges::find(found.found, 0) - found.found.begin();
    item.poses.push_back({"a pose that was missed",
                          posed_joints(*arm.model, configurations[static_cast<std::size_t>(first)])});
  }
  if (share > (joints >= 6 ? kGoalOfMany : kGoalOfFew) && item.verdict == Verdict::passed)
    item.verdict = Verdict::warned;
  out.add(std::move(item));
  return judge_workspace(context, arm, configurations, out);
}

}  // namespace

CheckResult check_reachability(const CheckContext& context) {
  const Subject& subject = context.subject;
  if (subject.arms.empty())
    return not_applicable(
        "T1", "no group of joints is an arm: a chain with a tip that is a controller's or SRDF's group");
  CheckResult out = begin_result("T1");
  Diagnostics notes;
  bool any_reached = false;
  for (const ArmGroup& group : subject.arms)
    any_reached = judge_arm(context, judged_arm(subject, group, notes), out) || any_reached;
  if (context.suite.workspace && !any_reached)
    out.fail("workspace",
             fmt::format("nothing of the suite's workspace is reached; {}", fmt::join(out.notes, "; ")),
             "the box of the suite, its frame, or the limits of the joints");
  for (const Diagnostic& note : notes.all()) out.notes.push_back(note.message);
  const auto worst = std::ranges::max_element(
      out.metrics, {}, [](const Metric& metric) { return metric.name == "missed" ? metric.value : -1.0; });
  out.summary = worst == out.metrics.end() ? "no free configuration"
                                           : fmt::format("{:.3g} % missed (limit {:.3g} %)", worst->value,
                                                         100 * context.suite.max_missed);
  return out;
}

}  // namespace doppel
