// doppel info: a summary of a description on one screen.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/description_target.h"
#include "app/output.h"
#include "app/verbs/found_controllers.h"
#include "app/verbs/verbs.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/review/conversion/summary.h"
#include "doppel/review/conversion/tree_labels.h"
#include "doppel/robot/ik/ik_solver.h"
#include "doppel/robot/reach/arm_group.h"
#include "doppel/scenario/resolve/described_arms.h"

namespace doppel::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kPoseNumbers = 6;

struct RobotInfoOptions {
  std::vector<std::string> target;
  bool json = false;
};

// The number of operations of one overlay that are effective.
struct OverlayState {
  std::filesystem::path file;
  std::string prefix;
  bool included = false;
  std::size_t operations = 0, applied = 0, already_there = 0;
};

std::vector<OverlayState> overlay_states(DescriptionTarget& target) {
  Diagnostics reported_on_loading;
  ExpandedDescription expanded =
      expand_description(target.target.description, target.arguments, target.resolver, reported_on_loading);
  std::vector<OverlayState> out;
  for (const AppliedOverlay& one : apply_overlays(expanded, target.resolver, reported_on_loading)) {
    const auto count = [&one](OperationState state) {
      return static_cast<std::size_t>(std::ranges::count(one.outcomes, state, &OperationOutcome::state));
    };
    out.push_back({one.overlay.file, one.prefix, one.included, one.outcomes.size(),
                   count(OperationState::applied), count(OperationState::already_there)});
  }
  return out;
}

std::string overlay_lines(const std::vector<OverlayState>& states) {
  std::string out;
  for (const OverlayState& state : states) {
    out += fmt::format("{}{}: {} of {} applied", out.empty() ? "" : "\n                 ",
                       shown_path(state.file), state.applied, state.operations);
    if (state.already_there > 0) out += fmt::format(", {} already in the description", state.already_there);
    if (state.included) out += ", beside an included file";
    if (!state.prefix.empty()) out += fmt::format(", for names that begin with '{}'", state.prefix);
  }
  return out.empty() ? "none" : out;
}

Json overlay_json(const OverlayState& state) {
  return {{"file", shown_path(state.file)},
          {"operations", state.operations},
          {"applied", state.applied},
          {"already_there", state.already_there}};
}

Json joints_json(const RobotDescription& robot) {
  Json out = Json::array();
  const auto number = [](const std::optional<double>& value) { return value ? Json(*value) : Json(); };
  for (const Joint& joint : robot.joints) {
    Json node{{"name", joint.name},
              {"type", type_word(joint.type)},
              {"parent", joint.parent},
              {"child", joint.child}};
    if (joint.limits) {
      if (joint.limits->has_position) {
        node["lower"] = joint.limits->lower;
        node["upper"] = joint.limits->upper;
      }
      node["effort"] = number(joint.limits->effort);
      node["velocity"] = number(joint.limits->velocity);
    }
    if (joint.mimic) node["mimic"] = joint.mimic->joint;
    out.push_back(std::move(node));
  }
  return out;
}

Json hardware_json(const RobotDescription& robot) {
  Json out = Json::array();
  for (const HardwareDescription& hardware : robot.hardware) {
    Json joints = Json::array();
    for (const HardwareJointDescription& joint : hardware.joints) joints.push_back(joint.name);
    out.push_back(
        {{"name", hardware.name}, {"type", hardware.type}, {"plugin", hardware.plugin}, {"joints", joints}});
  }
  return out;
}

std::string info_as_json(const LoadedDescription& loaded, const RobotSummary& summary,
                         const std::vector<OverlayState>& overlays,
                         const std::vector<JointGroup>& controllers, Json groups) {
  const RobotDescription& robot = loaded.robot;
  const auto vector_json = [](const Eigen::Vector3d& v) { return Json{v.x(), v.y(), v.z()}; };
  Json out{{"version", 1}, {"robot", robot.name}, {"files", Json::array()}};
  for (const auto& file : loaded.files) out["files"].push_back(shown_path(file));
  out["links"] = robot.links.size();
  out["joints"] = joints_json(robot);
  out["driven"] = summary.driven;
  out["mass"] = summary.mass;
  out["reach"] = summary.reach;
  if (!summary.bounds.isEmpty()) {
    out["bounds"] = {{"lower", vector_json(summary.bounds.min())},
                     {"upper", vector_json(summary.bounds.max())}};
  }
  out["meshes"] = {{"files", summary.meshes.files},
                   {"triangles", summary.meshes.triangles},
                   {"missing", summary.meshes.missing},
                   {"unreadable", summary.meshes.unreadable}};
  out["ros2_control"] = hardware_json(robot);
  out["controllers"] = Json::array();
  for (const JointGroup& controller : controllers)
    out["controllers"].push_back(
        {{"name", controller.name}, {"type", controller.type}, {"joints", controller.joints}});
  out["groups"] = std::move(groups);
  out["overlay"] = Json();
  out["included_overlays"] = Json::array();
  for (const OverlayState& state : overlays) {
    if (!state.included) {
      out["overlay"] = overlay_json(state);
      continue;
    }
    Json one = overlay_json(state);
    one["prefix"] = state.prefix;
    out["included_overlays"].push_back(std::move(one));
  }
  return out.dump(2) + "\n";
}

// A group of joints, and how its tip is brought to poses.
struct GroupInfo {
  PlanningGroup group;
  std::unique_ptr<IkSolver> solver = nullptr;  // of an arm that is a chain
  std::string problem = "";                    // of an arm that is none
};

// "group 'wheels' is no chain of joints, ..." without what stands before it in the table.
std::string problem_of(const std::string& group, std::string message) {
  for (const std::string& part :
       {fmt::format("group '{}' ", group), std::string("is "), std::string("has ")}) {
    if (message.starts_with(part)) message.erase(0, part.size());
  }
  return message;
}

// The groups that are found, and those of the SRDF, which `doppel ik` takes under the same names.
std::vector<GroupInfo> group_infos(const std::shared_ptr<const Model>& model, const RobotDescription& robot,
                                   DescriptionTarget& target, const std::vector<JointGroup>& controllers) {
  std::vector<GroupInfo> out;
  for (PlanningGroup& group : find_planning_groups(*model, controllers)) {
    Diagnostics notes;
    (void)find_arms(*model, {group}, notes);
    GroupInfo info{.group = std::move(group)};
    if (!notes.all().empty()) info.problem = problem_of(info.group.name, notes.all().front().message);
    out.push_back(std::move(info));
  }
  Diagnostics notes;
  for (ArmGroup& arm : described_arms(*model, robot, &target.target, target.resolver, controllers, notes)) {
    auto info = std::ranges::find(out, arm.name, [](const GroupInfo& one) { return one.group.name; });
    if (info == out.end()) {
      out.push_back({.group = {.name = arm.name, .joints = arm.chain.variables}});
      info = out.end() - 1;
    }
    info->problem.clear();
    info->solver = std::make_unique<IkSolver>(model, std::move(arm.chain));
  }
  // A chain that the SRDF has, too, goes by the SRDF's name alone.
  for (GroupInfo& info : out) {
    if (info.group.gripper || info.solver != nullptr || !info.problem.empty()) continue;
    for (const GroupInfo& other : out) {
      if (other.solver != nullptr && other.solver->chain().tip_link == info.group.tip_link)
        info.problem = fmt::format("named '{}' by the SRDF", other.group.name);
    }
  }
  return out;
}

std::string link_name(const Model& model, int link) {
  return link < 0 ? "" : model.links[static_cast<std::size_t>(link)].name;
}

std::string about_group(const GroupInfo& info, const std::vector<GroupInfo>& all, const Model& model) {
  const PlanningGroup& group = info.group;
  std::string out = fmt::format("{} joint{}", group.joints.size(), group.joints.size() == 1 ? "" : "s");
  if (info.solver != nullptr) {
    out += fmt::format(", {} to {}, {}", link_name(model, info.solver->chain().base_link),
                       link_name(model, info.solver->chain().tip_link), info.solver->about_method());
    const int freedom = info.solver->task_space().freedom;
    if (freedom < kPoseNumbers)
      out += fmt::format(", sets {} of the {} numbers of a pose", freedom, kPoseNumbers);
  }
  if (group.gripper && group.parent_link >= 0) out += ", on " + link_name(model, group.parent_link);
  if (group.gripper && group.parent_group >= 0)
    out += " of " + all[static_cast<std::size_t>(group.parent_group)].group.name;
  return info.problem.empty() ? out : out + ", " + info.problem;
}

std::string group_table(const std::vector<GroupInfo>& groups, const Model& model) {
  std::size_t width = 0;
  for (const GroupInfo& info : groups) width = std::max(width, info.group.name.size() + 1);
  std::string out = groups.empty() ? "" : "\ngroups\n";
  for (const GroupInfo& info : groups)
    out += fmt::format("  {:<{}} {}\n", info.group.name + ":", width, about_group(info, groups, model));
  return out;
}

Json groups_json(const std::vector<GroupInfo>& groups, const Model& model) {
  Json out = Json::array();
  for (const GroupInfo& info : groups) {
    const PlanningGroup& group = info.group;
    Json joints = Json::array();
    for (const int joint : group.joints) joints.push_back(model.joints[static_cast<std::size_t>(joint)].name);
    Json node{{"name", group.name}, {"gripper", group.gripper}, {"joints", std::move(joints)}};
    if (info.solver != nullptr) {
      node["base"] = link_name(model, info.solver->chain().base_link);
      node["tip"] = link_name(model, info.solver->chain().tip_link);
      node["inverse_kinematics"] = info.solver->about_method();
      node["freedom"] = info.solver->task_space().freedom;
    }
    if (group.gripper && group.parent_link >= 0) node["parent_link"] = link_name(model, group.parent_link);
    if (group.gripper && group.parent_group >= 0)
      node["parent_group"] = groups[static_cast<std::size_t>(group.parent_group)].group.name;
    if (!info.problem.empty()) node["problem"] = info.problem;
    out.push_back(std::move(node));
  }
  return out;
}

std::vector<std::filesystem::path> shown_paths(const std::vector<std::filesystem::path>& files) {
  std::vector<std::filesystem::path> out;
  for (const auto& file : files) out.emplace_back(shown_path(file));
  return out;
}

int run_info(const RobotInfoOptions& options) {
  DescriptionTarget target = open_target(options.target);
  const LoadedDescription loaded = load_target(target);
  Diagnostics diagnostics;
  const auto model = std::make_shared<const Model>(compile_model(loaded.robot, BaseKind::fixed, diagnostics));
  print_diagnostics(diagnostics);
  const RobotSummary summary = summarise(loaded.robot, *model);
  const std::vector<OverlayState> overlays = overlay_states(target);
  FoundControllers found = find_controllers(loaded.robot, target);
  const Surroundings surroundings{shown_paths(loaded.files), overlay_lines(overlays),
                                  shown_paths(found.files), std::move(found.controllers)};
  const std::vector<GroupInfo> groups = group_infos(model, loaded.robot, target, surroundings.controllers);
  deliver(options.json
              ? info_as_json(loaded, summary, overlays, surroundings.controllers, groups_json(groups, *model))
              : summary_text(loaded.robot, summary, surroundings) + group_table(groups, *model));
  return 0;
}

}  // namespace

void add_info(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RobotInfoOptions>();
  CLI::App* verb = app.add_subcommand("info", "Print a summary of a description");
  add_target(*verb, options->target);
  verb->add_flag("--json", options->json, "Print a JSON object to stdout, in SI units");
  verb->footer(
      "Examples:\n  doppel info omarm_one\n  doppel info omarm_one --json | jq .groups   # base, tip, "
      "inverse kinematics\n"
      "  doppel info my_arm.urdf.xacro use_sim:=true");
  verb->callback([options, &exit_code] { exit_code = run_info(*options); });
}

}  // namespace doppel::app
