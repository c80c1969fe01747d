#include "reach_robots.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <random>

#include "doppel/description/overlay/overlay.h"
#include "doppel/scenario/resolve/controllers_search.h"
#include "doppel/scenario/resolve/joint_groups.h"
#include "doppel/scenario/resolve/open_target.h"

namespace doppel::bench {
namespace {

constexpr std::uint64_t kTargetSeed = 1;
constexpr double kTurn = 2 * M_PI, kLimitRounding = 1e-12;

int find_end(const Model& model, const std::string& name) {
  const int link = model.find_link(name);
  if (link < 0) throw InputError("bench.link", {}, fmt::format("the robot has no link '{}'", name), "");
  return link;
}

}  // namespace

std::string RobotWord::shown() const {
  std::string out = robot;
  if (!base.empty()) out += fmt::format(":{}:{}", base, tip);
  for (const auto& [name, value] : arguments) out += fmt::format(" {}:={}", name, value);
  return out;
}

std::vector<RobotWord> parse_robots(const std::vector<std::string>& words) {
  std::vector<RobotWord> out;
  for (const std::string& word : words) {
    const std::size_t assigned = word.find(":=");
    if (assigned != std::string::npos && !out.empty()) {
      out.back().arguments.emplace_back(word.substr(0, assigned), word.substr(assigned + 2));
      continue;
    }
    RobotWord robot;
    const std::size_t first = word.find(':'), second = word.find(':', first + 1);
    robot.robot = word.substr(0, first);
    if (first != std::string::npos && second != std::string::npos) {
      robot.base = word.substr(first + 1, second - first - 1);
      robot.tip = word.substr(second + 1);
    }
    out.push_back(std::move(robot));
  }
  return out;
}

BenchRobot open_robot(const RobotWord& word) {
  BenchRobot out;
  OpenedTarget opened = open_target(word.robot, word.arguments, DOPPEL_ROBOTS);
  Diagnostics diagnostics;
  out.description =
      load_corrected(opened.target.description, opened.arguments, opened.resolver, diagnostics).robot;
  out.model = std::make_shared<const Model>(compile_model(out.description, BaseKind::fixed, diagnostics));
  if (!word.base.empty()) {
    const int base = find_end(*out.model, word.base), tip = find_end(*out.model, word.tip);
    out.arms.push_back({word.base + " to " + word.tip, make_chain(*out.model, base, tip)});
    out.groups = 1;
    return out;
  }
  std::vector<JointGroup> controllers;
  for (const ControllersFile& file :
       find_controllers_files(out.description, opened.target, opened.resolver).files) {
    for (JointGroup& group : joint_groups(file)) controllers.push_back(std::move(group));
  }
  const auto groups = find_planning_groups(*out.model, controllers);
  out.groups = static_cast<int>(
      std::count_if(groups.begin(), groups.end(), [](const PlanningGroup& g) { return !g.gripper; }));
  out.arms = find_arms(*out.model, groups, out.no_arm);
  return out;
}

ReachTargets reachable_targets(const Model& model, const Chain& chain, int count) {
  std::mt19937_64 random(kTargetSeed);
  std::uniform_real_distribution<double> unit(0, 1);
  Data data(model);
  Eigen::VectorXd q = model.neutral(), u(chain.size());
  ReachTargets out;
  for (int i = 0; i < count; ++i) {
    for (int v = 0; v < chain.size(); ++v) {
      const int joint = chain.variables[static_cast<std::size_t>(v)];
      const bool slides = model.joints[static_cast<std::size_t>(joint)].type == JointType::prismatic;
      const double free = slides ? 1.0 : M_PI;
      const double low = std::isfinite(chain.lower[v]) ? chain.lower[v] : -free;
      const double high = std::isfinite(chain.upper[v]) ? chain.upper[v] : free;
      u[v] = low + (high - low) * unit(random);
    }
    chain.apply(model, u, q);
    forward_kinematics(model, data, q);
    out.X_BT.emplace_back(data.X_WL[static_cast<std::size_t>(chain.base_link)].inverse(Eigen::Isometry) *
                          data.X_WL[static_cast<std::size_t>(chain.tip_link)]);
  }
  return out;
}

IkJudge::IkJudge(const Model& model, const Chain& chain, double tolerance)
    : model_(model), chain_(chain), tolerance_(tolerance), data_(model), q_(model.neutral()) {}

bool IkJudge::right(const Eigen::VectorXd& u, const Pose& X_BT) {
  if (!u.allFinite()) return false;
  for (int v = 0; v < chain_.size(); ++v) {
    if (u[v] < chain_.lower[v] - kLimitRounding || u[v] > chain_.upper[v] + kLimitRounding) return false;
  }
  chain_.apply(model_, u, q_);
  forward_kinematics(model_, data_, q_);
  const Pose X_BF = data_.X_WL[static_cast<std::size_t>(chain_.base_link)].inverse(Eigen::Isometry) *
                    data_.X_WL[static_cast<std::size_t>(chain_.tip_link)];
  const double position = (X_BF.translation() - X_BT.translation()).norm();
  const double rotation =
      Eigen::Quaterniond(X_BF.linear()).angularDistance(Eigen::Quaterniond(X_BT.linear()));
  return position <= tolerance_ && rotation <= tolerance_;
}

bool IkJudge::right_by_turns(Eigen::VectorXd& u, const Pose& X_BT) {
  for (int v = 0; v < chain_.size(); ++v) {
    if (!chain_.turns[static_cast<std::size_t>(v)] || !std::isfinite(u[v])) continue;
    if (u[v] > chain_.upper[v]) u[v] -= kTurn * std::ceil((u[v] - chain_.upper[v]) / kTurn);
    if (u[v] < chain_.lower[v]) u[v] += kTurn * std::ceil((chain_.lower[v] - u[v]) / kTurn);
  }
  return right(u, X_BT);
}

double thread_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

double clock_us() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::micro>(now).count();
}

double quantile(std::vector<double>& values, double part) {
  if (values.empty()) return 0;
  const auto index =
      std::min(values.size() - 1, static_cast<std::size_t>(part * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(index), values.end());
  return values[index];
}

}  // namespace doppel::bench
