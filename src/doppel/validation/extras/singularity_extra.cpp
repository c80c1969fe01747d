#include "doppel/validation/extras/singularity_extra.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <optional>

#include "doppel/robot/ik/chain_jacobian.h"
#include "doppel/robot/ik/task_space.h"
#include "doppel/validation/extras/detail/extra_arm.h"
#include "doppel/validation/extras/detail/singular_values.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr double kLineStep = 0.005;  // m or rad along a line
constexpr double kMaxJump = 0.5;     // rad or m of a joint between two points of a line: another branch
constexpr std::size_t kMaxLines = 20;

struct LineWalk {
  double least = 1;  // ratio
  double place = 0;  // m from the start of the line
  double length = 0;
  double ended = -1;  // m from the start, where the arm cannot continue; -1: it gets to the end
  Eigen::VectorXd q;  // of the least ratio
  std::vector<int> variables;
  PlotCurve curve;
};

class SingularityJudge {
 public:
  SingularityJudge(const CheckContext& context, CheckResult& out) : context_(context), out_(out) {}

  void judge(const ExtraArm& arm) {
    const int freedom = find_task_space(arm.chain()).freedom;
    judge_samples(arm, freedom);
    const std::vector<NamedPose> poses = named_poses(context_);
    for (const NamedPose& pose : poses) judge_pose(arm, freedom, pose);
    PlotPanel panel;
    panel.title = fmt::format("{}: least / largest singular value on lines", arm.name());
    panel.x_axis = "way of the tool, m";
    panel.bands.push_back({"singular", 0, kSingularRatio, 0, kInfinity});
    CheckItem lines;
    lines.subject = arm.name() + ", lines";
    std::size_t count = 0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      for (std::size_t k = i + 1; k < poses.size() && count < kMaxLines; ++k, ++count)
        judge_line(arm, freedom, poses[i], poses[k], lines, panel);
    }
    if (count == 0) {
      out_.notes.push_back(arm.name() +
                           ": the suite names no poses, so that there are no lines between poses");
      return;
    }
    double end = 0;
    for (const PlotCurve& curve : panel.curves)
      end = std::max(end, curve.times.empty() ? 0 : curve.times.back());
    panel.bands.front().end = end;
    lines.curves.push_back(std::move(panel));
    out_.add(std::move(lines));
  }

  void finish() {
    out_.summary = fmt::format("{} of {} named poses and {} of {} lines below {}", singular_poses_, poses_,
                               singular_lines_, lines_, kSingularRatio);
    if (lines_ == 0)
      out_.summary = fmt::format("{} of {} named poses below {}", singular_poses_, poses_, kSingularRatio);
  }

 private:
  // How much of the joint space is singular, and by which joints.
  void judge_samples(const ExtraArm& arm, int freedom) {
    const std::vector<ArmPlace> places = arm.places(context_.amount(200, 1000, 10'000), context_.seed);
    if (places.empty()) return;
    std::size_t singular = 0;
    for (const ArmPlace& place : places) {
      const Eigen::VectorXd u = arm.chain().variables_of(arm.model(), place.q);
      singular += singular_values(arm.chain(), u, freedom).ratio < kSingularRatio ? 1 : 0;
    }
    const double share = kPercent * static_cast<double>(singular) / static_cast<double>(places.size());
    out_.metrics.push_back({"singular share of the joint space", arm.name(), share, "%"});
    out_.notes.push_back(fmt::format("{}: {:.2g} % of {} free configurations are below {}", arm.name(), share,
                                     places.size(), kSingularRatio));
  }

  [[nodiscard]] static std::string names(const ExtraArm& arm, const std::vector<int>& variables) {
    std::vector<std::string> out;
    for (const int variable : variables) out.push_back(arm.joint(variable).name);
    return fmt::format("{}", fmt::join(out, ", "));
  }

  void judge_pose(const ExtraArm& arm, int freedom, const NamedPose& pose) {
    const SingularValues values =
        singular_values(arm.chain(), arm.chain().variables_of(arm.model(), pose.q), freedom);
    const bool is_singular = values.ratio < kSingularRatio;
    ++poses_;
    singular_poses_ += is_singular ? 1 : 0;
    const std::string subject = fmt::format("{}, {}", arm.name(), pose.name);
    out_.metrics.push_back(
        {"singular value ratio", subject, values.ratio, "", std::nullopt, Metric::Better::higher});
    CheckItem item;
    item.subject = subject;
    item.message = fmt::format("{} {:.3g} (singular below {})", is_singular ? "singular: ratio" : "ratio",
                               values.ratio, kSingularRatio);
    if (is_singular) {
      item.message += ": " + names(arm, values.variables) + " move the tool in no new direction";
      item.poses.push_back({pose.name, posed_joints(arm.model(), pose.q)});
    }
    out_.add(std::move(item));
  }

  // The tool on a straight line at an even turn, from the first pose on, always in the nearest branch.
  LineWalk walk_line(const ExtraArm& arm, int freedom, const Eigen::VectorXd& start, const Pose& end) {
    ArmReach reach = arm.reach();
    const TaskSpace task = find_task_space(arm.chain());
    Data data(arm.model());
    forward_kinematics(arm.model(), data, start);
    const Pose begin = data.X_WL[static_cast<std::size_t>(arm.chain().tip_link)];
    const Eigen::Quaterniond from_turn(begin.linear()), to_turn(end.linear());
    LineWalk out;
    out.length = (end.translation() - begin.translation()).norm();
    const double size = std::max(out.length, from_turn.angularDistance(to_turn) * arm.chain().length);
    const int steps = std::max(1, static_cast<int>(std::ceil(size / kLineStep)));
    Eigen::VectorXd q = start;
    for (int i = 0; i <= steps; ++i) {
      const double share = static_cast<double>(i) / steps;
      ReachQuery query;
      query.X_WT.translation() = begin.translation() + share * (end.translation() - begin.translation());
      query.X_WT.linear() = from_turn.slerp(share, to_turn).toRotationMatrix();
      query.task = task.task;
      query.q = q;
      query.collisions = false;
      const ReachAnswer answer = reach.answer(query);
      const bool continues =
          answer.solved && (i == 0 || (answer.branches.front().q - q).cwiseAbs().maxCoeff() < kMaxJump);
      if (!continues) {
        out.ended = share * out.length;
        return out;
      }
      q = answer.branches.front().q;
      const SingularValues values =
          singular_values(arm.chain(), arm.chain().variables_of(arm.model(), q), freedom);
      out.curve.times.push_back(share * out.length);
      out.curve.values.push_back(values.ratio);
      if (values.ratio < out.least || i == 0) {
        out.least = values.ratio;
        out.place = share * out.length;
        out.q = q;
        out.variables = values.variables;
      }
    }
    return out;
  }

  void judge_line(const ExtraArm& arm, int freedom, const NamedPose& from_pose, const NamedPose& to_pose,
                  CheckItem& item, PlotPanel& panel) {
    Data data(arm.model());
    forward_kinematics(arm.model(), data, to_pose.q);
    LineWalk walk =
        walk_line(arm, freedom, from_pose.q, data.X_WL[static_cast<std::size_t>(arm.chain().tip_link)]);
    context_.report(0.5);
    const std::string name = fmt::format("{} to {}", from_pose.name, to_pose.name);
    const bool is_singular = walk.least < kSingularRatio;
    ++lines_;
    singular_lines_ += is_singular ? 1 : 0;
    out_.metrics.push_back({"least singular value ratio", fmt::format("{}, {}", arm.name(), name), walk.least,
                            "", std::nullopt, Metric::Better::higher});
    std::string text =
        fmt::format("{}: {:.3g} at {:.3f} m of {:.3f} m", name, walk.least, walk.place, walk.length);
    if (is_singular) text += fmt::format(" ({})", names(arm, walk.variables));
    if (walk.ended >= 0)
      text += fmt::format(", ends at {:.3f} m, where the arm cannot continue in its branch", walk.ended);
    item.message += (item.message.empty() ? "" : "; ") + text;
    if (is_singular || walk.ended >= 0)
      item.poses.push_back({name, posed_joints(arm.model(), walk.q.size() > 0 ? walk.q : from_pose.q)});
    walk.curve.label = name;
    panel.curves.push_back(std::move(walk.curve));
  }

  const CheckContext& context_;
  CheckResult& out_;
  int poses_ = 0, singular_poses_ = 0, lines_ = 0, singular_lines_ = 0;
};

}  // namespace

SingularValues singular_values(const Chain& chain, const Eigen::VectorXd& u, int freedom) {
  constexpr double kPart = 0.3;  // of the unit vector of rates
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled_jacobian(chain, u), Eigen::ComputeThinV);
  const Eigen::VectorXd& values = svd.singularValues();
  const Eigen::Index last = std::min<Eigen::Index>(freedom, values.size()) - 1;
  SingularValues out;
  if (last < 0 || values[0] <= 0) return out;
  out.ratio = values[last] / values[0];
  const Eigen::VectorXd rates = svd.matrixV().col(last).cwiseAbs();
  for (Eigen::Index k = 0; k < rates.size(); ++k)
    if (rates[k] > kPart) out.variables.push_back(static_cast<int>(k));
  std::ranges::stable_sort(out.variables, std::greater(), [&](int k) { return rates[k]; });
  return out;
}

CheckResult check_singularities(const CheckContext& context) {
  const std::vector<ExtraArm> arms = extra_arms(context);
  if (arms.empty()) return not_applicable("X11", no_arm_reason(context));
  CheckResult out = begin_result("X11");
  SingularityJudge judge(context, out);
  for (const ExtraArm& arm : arms) judge.judge(arm);
  judge.finish();
  return out;
}

}  // namespace doppel
