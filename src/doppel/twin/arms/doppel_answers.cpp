// doppel/ik, doppel/arms and doppel/reach.
#include <fmt/format.h>

#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/base/core/thrown.h"
#include "doppel/sensors/rigs/pose_messages.h"
#include "doppel/twin/arms/detail/arm_answers.h"

namespace doppel {
namespace {

namespace dsrv = doppel_msgs::srv;

constexpr int kDefaultDirections = 20, kMaxDirections = 1000;
constexpr double kSmallestCell = 1e-3;  // m

const std::vector<std::string> kTaskNames = {"pose", "axis", "angle", "position"};

std::optional<IkTask> task_named(const std::string& name) {
  if (name.empty()) return std::nullopt;
  for (std::size_t i = 0; i < kTaskNames.size(); ++i) {
    if (kTaskNames[i] == name) return static_cast<IkTask>(i);
  }
  throw MoveItError{0, fmt::format("there is no task '{}'{}; they are pose, axis, angle and position", name,
                                   did_you_mean(name, kTaskNames))};
}

const char* reason_of(const ReachAnswer& answer) {
  switch (answer.failure->obstacle) {
    case IkObstacle::out_of_reach:
      return "out_of_reach";
    case IkObstacle::rotation:
      return "rotation";
    case IkObstacle::limits:
      return "limits";
    case IkObstacle::refused:
      break;
  }
  return "collision";
}

// The request's seed on top of the robot's present configuration.
Eigen::VectorXd seed_of(const ArmSnapshot& snapshot, const dsrv::SolveIk::Request& request) {
  moveit_msgs::msg::RobotState state;
  state.joint_state.name = request.joint_names;
  state.joint_state.position = request.seed;
  return with_state(snapshot, state);
}

void solve(const ArmContext& context, const dsrv::SolveIk::Request& request,
           dsrv::SolveIk::Response& response) {
  context.arms.show(context.snapshot);
  ArmReach& arm = context.arms.arm(request.group, request.tip_link);
  const Model& model = context.snapshot.model();
  const Chain& chain = arm.solver().chain();
  response.group = context.arms.name_of_group(request.group, request.tip_link);
  response.base_link = model.links[static_cast<std::size_t>(chain.base_link)].name;
  response.tip_link = model.links[static_cast<std::size_t>(chain.tip_link)].name;
  response.tool_axis = to_vector_msg(arm.solver().task_space().tool_axis);
  for (const int joint : chain.variables)
    response.joint_names.push_back(model.joints[static_cast<std::size_t>(joint)].name);
  ReachQuery query;
  query.q = seed_of(context.snapshot, request);
  const Pose X_RF = pose_in_root(context.snapshot, query.q, request.pose.header.frame_id, Pose::Identity());
  query.X_WT = X_RF * checked_pose(request.pose.pose);
  query.task = task_named(request.task);
  if (request.position_tolerance > 0) query.position_tolerance = request.position_tolerance;
  if (request.rotation_tolerance > 0) query.rotation_tolerance = request.rotation_tolerance;
  query.collisions = !request.allow_collisions;
  query.every_branch = request.every_branch;
  const ReachAnswer answer = arm.answer(query);
  const Pose X_RB = arm.base_pose(query.q);
  response.solved = answer.solved;
  response.task = kTaskNames[static_cast<std::size_t>(answer.task)];
  response.message = answer.solved ? answer.note : answer.message;
  for (const ReachBranch& branch : answer.branches)
    response.branches.push_back(branch_message(branch, X_RB, X_RF));
  if (answer.solved) return;
  response.reason = reason_of(answer);
  if (answer.nearest) response.branches.push_back(branch_message(*answer.nearest, X_RB, X_RF));
}

ReachMapOptions map_options(const ArmContext& context, const dsrv::GetReach::Request& request) {
  ReachMapOptions out;
  const Eigen::Vector3d approach = from_msg(request.approach);
  if (!std::isfinite(request.cell) || !approach.allFinite() ||
      (request.cell != 0 && request.cell < kSmallestCell))
    throw MoveItError{0, "the cell is 0 or at least 1 mm, and all numbers are finite"};
  if (request.directions > kMaxDirections)
    throw MoveItError{0, fmt::format("at most {} directions are possible", kMaxDirections)};
  out.cell = request.cell;
  out.directions = request.directions == 0 ? kDefaultDirections : static_cast<int>(request.directions);
  if (approach.norm() > 1e-9) out.approach = approach.normalized();
  out.collisions = !request.allow_collisions;
  out.q = context.snapshot.q;
  out.threads = 1;
  out.progress = [&context](double) { return !context.stopping(); };
  return out;
}

void map_reach(const ArmContext& context, const dsrv::GetReach::Request& request,
               dsrv::GetReach::Response& response) {
  context.arms.show(context.snapshot);
  const Model& model = context.snapshot.model();
  const ReachMapOptions options = map_options(context, request);
  ArmReach& arm = context.arms.arm(request.group, "");
  const Chain& chain = arm.solver().chain();
  const ReachMap map =
      make_reach_map(context.snapshot.robot->model, chain, context.arms.scene_of(request.group), options);
  const ReachFacts facts =
      reach_facts(map, arm.base_pose(options.q) * chain.joints.front().X_PZ.translation());
  response.cloud = cloud_message(map, model.links[0].name, Time{});
  response.cell = map.cell;
  response.farthest = facts.farthest;
  response.volume = facts.volume;
  response.dexterous_volume = facts.dexterous_volume;
  response.success = !map.cancelled;
  if (map.cancelled) response.message = "a newer request ended this one";
}

template <class Answer, class Response>
void answer_or_explain(Response& response, Answer answer) {
  try {
    answer();
  } catch (const MoveItError& problem) {
    refuse(response, problem.message);
  } catch (const InputError& problem) {
    const Diagnostic& first = problem.diagnostics().front();
    refuse(response, first.fix.empty() ? first.message : first.message + "; " + first.fix);
  } catch (...) {
    refuse(response, thrown_text());
  }
}

}  // namespace

void answer_solve_ik(const ArmContext& context, const dsrv::SolveIk::Request& request,
                     dsrv::SolveIk::Response& response) {
  answer_or_explain(response, [&] { solve(context, request, response); });
}

void answer_reach(const ArmContext& context, const dsrv::GetReach::Request& request,
                  dsrv::GetReach::Response& response) {
  answer_or_explain(response, [&] { map_reach(context, request, response); });
}

void answer_list_arms(const ArmContext& context, const dsrv::ListArms::Request& /*request*/,
                      dsrv::ListArms::Response& response) {
  answer_or_explain(response, [&] {
    context.arms.show(context.snapshot);
    const Model& model = context.snapshot.model();
    for (const ArmGroup& group : context.arms.groups()) {
      response.groups.push_back(group.name);
      response.base_links.push_back(model.links[static_cast<std::size_t>(group.chain.base_link)].name);
      response.tip_links.push_back(model.links[static_cast<std::size_t>(group.chain.tip_link)].name);
      response.methods.push_back(IkSolver(context.snapshot.robot->model, group.chain).about_method());
    }
  });
}

void refuse(dsrv::SolveIk::Response& response, const std::string& why) {
  response.solved = false;
  response.reason = "request";
  response.message = why;
}
void refuse(dsrv::ListArms::Response& /*response*/, const std::string& /*why*/) {}
void refuse(dsrv::GetReach::Response& response, const std::string& why) {
  response.success = false;
  response.message = why;
}

}  // namespace doppel
