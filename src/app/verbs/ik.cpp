// doppel ik: configurations that bring an arm's tip to a pose, or why there are none.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/output.h"
#include "app/verbs/arm_target.h"
#include "app/verbs/verbs.h"
#include "doppel/base/math/units.h"

namespace doppel::app {
namespace {

using Json = nlohmann::ordered_json;

struct IkOptions {
  ArmOptions arm;
  PoseOptions pose;
  bool every_branch = false, json = false;
  double position_tolerance = kIkPositionTolerance, rotation_tolerance = kIkRotationTolerance;
};

const char* name_of(IkTask task) {
  switch (task) {
    case IkTask::pose:
      return "position and rotation";
    case IkTask::axis:
      return "position and the tool's axis";
    case IkTask::angle:
      return "position and the slope of the tool's axis";
    case IkTask::position:
      break;
  }
  return "position";
}

const ModelJoint& joint_of(const ArmTarget& arm, int variable) {
  const Chain& chain = arm.reach->solver().chain();
  return arm.model->joints[static_cast<std::size_t>(chain.variables[static_cast<std::size_t>(variable)])];
}

std::string clearance_text(const ReachBranch& branch) {
  if (!branch.touching.empty()) {
    return fmt::format("none: '{}' and '{}' touch by {:.3g} mm", branch.nearest_pair.a, branch.nearest_pair.b,
                       branch.nearest_pair.depth * 1e3);
  }
  if (!std::isfinite(branch.clearance)) return "nothing within 0.5 m";
  return fmt::format("{:.3g} mm, '{}' to '{}'", branch.clearance * 1e3, branch.nearest_pair.a,
                     branch.nearest_pair.b);
}

std::string pose_text(const Pose& X) {
  const auto rounded = [](const Eigen::Vector3d& v, double step) {
    return Eigen::Vector3d(v.unaryExpr([step](double x) { return std::round(x / step) * step + 0.0; }));
  };
  const Eigen::Vector3d p = rounded(X.translation(), 1e-4),
                        r = rounded(rpy_from_rotation(X.linear()) / kDegree, 1e-2);
  return fmt::format("{:.4f} {:.4f} {:.4f} m, roll pitch yaw {:.2f} {:.2f} {:.2f} deg", p.x(), p.y(), p.z(),
                     r.x(), r.y(), r.z());
}

std::string move_line(const ArmTarget& arm, const ReachBranch& branch) {
  std::string out = "doppel move";
  for (int v = 0; v < branch.solution.u.size(); ++v) {
    const std::string word =
        fmt::format("{}={:.5g}", joint_of(arm, v).name, std::round(branch.solution.u[v] * 1e6) / 1e6 + 0.0);
    out += word.find(' ') == std::string::npos ? " " + word : " \"" + word + "\"";
  }
  return out;
}

// One configuration in full.
std::string branch_text(const ArmTarget& arm, const ReachBranch& branch) {
  std::size_t width = 14;
  for (int v = 0; v < branch.solution.u.size(); ++v) width = std::max(width, joint_of(arm, v).name.size());
  std::string out;
  for (int v = 0; v < branch.solution.u.size(); ++v) {
    const ModelJoint& joint = joint_of(arm, v);
    out += fmt::format("  {:<{}}  {:>12}\n", joint.name, width, shown_position(joint, branch.solution.u[v]));
  }
  const auto row = [&out, width](const char* name, const std::string& text) {
    out += fmt::format("  {:<{}}  {}\n", name, width, text);
  };
  row("tip", pose_text(arm.reach->base_pose(branch.q) * branch.solution.X_BT));
  if (arm.scene != nullptr) row("clearance", clearance_text(branch));
  row("from a limit", fmt::format("{:.0f} % of half the range", branch.limit_distance * 100));
  row("manipulability", fmt::format("{:.3g}", branch.manipulability));
  return out;
}

// All branches, one in a line.
std::string branches_table(const ArmTarget& arm, const std::vector<ReachBranch>& branches) {
  const Eigen::Index n = branches.front().solution.u.size();
  std::string out = "     ";
  for (int v = 0; v < n; ++v)
    out += fmt::format("{:>{}}", joint_of(arm, v).name,
                       std::max<std::size_t>(13, joint_of(arm, v).name.size() + 2));
  out += fmt::format("{:>12}{:>8}{:>16}\n", "clearance", "limits", "manipulability");
  for (std::size_t i = 0; i < branches.size(); ++i) {
    const ReachBranch& branch = branches[i];
    out += fmt::format("  {:>2} ", i + 1);
    for (int v = 0; v < n; ++v) {
      out += fmt::format("{:>{}}", shown_position(joint_of(arm, v), branch.solution.u[v]),
                         std::max<std::size_t>(13, joint_of(arm, v).name.size() + 2));
    }
    const std::string clearance = !branch.touching.empty() ? "touches"
                                  : std::isfinite(branch.clearance)
                                      ? fmt::format("{:.3g} mm", branch.clearance * 1e3)
                                      : "far";
    out += fmt::format("{:>12}{:>6.0f} %{:>16.3g}\n", clearance, branch.limit_distance * 100,
                       branch.manipulability);
  }
  return out;
}

Json branch_json(const ArmTarget& arm, const ReachBranch& branch) {
  Json out;
  Json joints = Json::object();
  for (int v = 0; v < branch.solution.u.size(); ++v) joints[joint_of(arm, v).name] = branch.solution.u[v];
  const Pose X = arm.reach->base_pose(branch.q) * branch.solution.X_BT;
  const Eigen::Quaterniond r(X.linear());
  out["joints"] = std::move(joints);
  out["position"] = {X.translation().x(), X.translation().y(), X.translation().z()};
  out["quaternion_xyzw"] = {r.x(), r.y(), r.z(), r.w()};
  out["position_error"] = branch.solution.position_error;
  out["rotation_error"] = branch.solution.rotation_error;
  out["free_rotation"] = branch.solution.free_rotation;
  out["distance"] = branch.solution.distance;
  out["clearance"] = std::isfinite(branch.clearance) ? Json(branch.clearance) : Json();
  out["limit_distance"] = branch.limit_distance;
  out["manipulability"] = branch.manipulability;
  out["touching"] = Json::array();
  for (const TouchingLinks& pair : branch.touching)
    out["touching"].push_back({{"a", pair.a}, {"b", pair.b}, {"depth", pair.depth}});
  return out;
}

std::string answer_json(const ArmTarget& arm, const ReachAnswer& answer) {
  Json out{{"version", 1}, {"robot", arm.robot}, {"group", arm.group}, {"solved", answer.solved}};
  if (answer.solved) out["task"] = name_of(answer.task);
  out["note"] = answer.note;
  out["message"] = answer.message;
  out["branches"] = Json::array();
  for (const ReachBranch& branch : answer.branches) out["branches"].push_back(branch_json(arm, branch));
  if (answer.nearest) out["nearest"] = branch_json(arm, *answer.nearest);
  return out.dump(2) + "\n";
}

std::string heading(const ArmTarget& arm) {
  const IkSolver& solver = arm.reach->solver();
  const auto link = [&arm](int index) { return arm.model->links[static_cast<std::size_t>(index)].name; };
  const int freedom = solver.task_space().freedom;
  return fmt::format("{}: {}, {} joint{} from {} to {}{}; {}\n", arm.robot, arm.group, solver.chain().size(),
                     solver.chain().size() == 1 ? "" : "s", link(solver.chain().base_link),
                     link(solver.chain().tip_link),
                     freedom < 6 ? fmt::format(", which set {} of the 6 degrees of freedom", freedom) : "",
                     solver.about_method());
}

std::string nearest_text(const ReachAnswer& answer, const ArmTarget& arm, IkTask task) {
  const IkSolution& nearest = answer.nearest->solution;
  const double rotation = (task == IkTask::pose ? nearest.free_rotation : nearest.rotation_error) / kDegree;
  std::string text = "the nearest pose that works ";
  text += nearest.position_error < 1e-6 ? "is at the position"
          : nearest.position_error < 1  ? fmt::format("is {:.3g} mm away", nearest.position_error * 1e3)
                                        : fmt::format("is {:.3g} m away", nearest.position_error);
  if (task != IkTask::position) text += fmt::format(", turned by {:.3g} deg", rotation);
  return text + ":\n" + branch_text(arm, *answer.nearest);
}

int run_ik(const IkOptions& options) {
  if (options.pose.position.empty()) {
    throw InputError("cli.at", {}, "no position is given",
                     "add --at X Y Z, in m: for example --at 0.2 0 0.15");
  }
  const ArmTarget arm = open_arm(options.arm);
  const AskedPose pose = asked_pose(options.pose, arm);
  ReachQuery query;
  query.X_WT = pose.X_WT;
  query.task = pose.task;
  query.q = arm.q;
  query.position_tolerance = options.position_tolerance;
  query.rotation_tolerance = options.rotation_tolerance;
  query.every_branch = options.every_branch;
  const ReachAnswer answer = arm.reach->answer(query);
  if (options.json) {
    deliver(answer_json(arm, answer));
    return answer.solved ? 0 : 1;
  }
  std::string text = heading(arm);
  if (!answer.solved) {
    text += fmt::format("\nno solution: {}\n", answer.message);
    if (answer.nearest) text += nearest_text(answer, arm, answer.task);
    deliver(text);
    return 1;
  }
  if (options.every_branch) {
    const bool endless = dimension(answer.task) < std::min(6, arm.reach->solver().chain().size());
    text += fmt::format("\n{}{} solution{} for {}\n", answer.branches.size(),
                        endless ? " of infinitely many" : "", answer.branches.size() == 1 ? "" : "s",
                        name_of(answer.task));
    text += branches_table(arm, answer.branches);
  } else {
    text +=
        fmt::format("\nsolved for {}\n", name_of(answer.task)) + branch_text(arm, answer.branches.front());
  }
  if (!answer.note.empty()) text += "  note: " + answer.note + "\n";
  text += "\n  " + move_line(arm, answer.branches.front()) + "\n";
  deliver(text);
  return 0;
}

}  // namespace

void add_ik(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<IkOptions>();
  CLI::App* verb =
      app.add_subcommand("ik", "Find joint positions for a pose of the tool, or why there are none");
  add_arm_options(*verb, options->arm);
  add_pose_options(*verb, options->pose);
  verb->add_flag("--all", options->every_branch, "List every branch, not only the nearest");
  verb->add_option("--position-tolerance", options->position_tolerance, "m (default 1e-6)")
      ->type_name("M")
      ->check(CLI::Range(1e-9, 1.0));
  verb->add_option("--rotation-tolerance", options->rotation_tolerance, "rad (default 1e-6)")
      ->type_name("RAD")
      ->check(CLI::Range(1e-9, M_PI));
  verb->add_flag("--json", options->json, "Print a JSON object to stdout, in m and rad");
  verb->footer(
      "Examples:\n  doppel ik omarm_one --at 0.2 0.1 0.1 --down\n  doppel ik my_arm.urdf --at 0.3 0 0.2 "
      "--rpy "
      "180deg 0 90deg --all\n  doppel ik kate --group arm --at 0.2 0 0.7      # the position alone\nThe exit "
      "code is 0 for a solution, 1 if there is none, 2 for wrong input. See doppel man reach.md");
  verb->callback([options, &exit_code] { exit_code = run_ik(*options); });
}

}  // namespace doppel::app
