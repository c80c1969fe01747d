#include "doppel/robot/reach/arm_reach.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "doppel/base/core/plugin_module.h"
#include "doppel/base/math/units.h"
#include "doppel/robot/ik/chain_jacobian.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/robot/semantics/self_collision.h"

namespace doppel {
namespace {

constexpr double kClearanceSearch = 0.5;  // m: farther, a clearance is of no interest
constexpr int kAllowedSamples = 200;

std::string free_rotation_note(IkTask task, const IkSolution& solution) {
  const double left = solution.free_rotation / kDegree;
  switch (task) {
    case IkTask::pose:
      return "";
    case IkTask::axis:
      return fmt::format("the rotation about the tool's axis is free: it is {:.1f} deg from the request",
                         left);
    case IkTask::angle:
      return fmt::format(
          "only the position and the slope of the tool's axis are met: the rotation is {:.1f} "
          "deg from the request",
          left);
    case IkTask::position:
      break;
  }
  return fmt::format("only the position is met: the rotation is {:.1f} deg from the request", left);
}

}  // namespace

struct ArmReach::Impl {
  Impl(std::shared_ptr<const Model> the_model, Chain chain, std::shared_ptr<const CollisionScene> the_scene)
      : model(the_model),
        solver(std::move(the_model), std::move(chain)),
        data(*model),
        moved(moving_variables(*model, solver.chain())) {
    if (the_scene == nullptr) return;
    context.emplace(std::move(the_scene));
    const auto& pairs = context->scene().tested_pairs();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (concerns(pairs[i].first, pairs[i].second)) concerned.push_back(i);
    }
  }

  // True if the arm moves the bodies against each other: only these can start or end to touch.
  [[nodiscard]] bool concerns(BodyId a, BodyId b) const { return bits_of(a) != bits_of(b); }
  [[nodiscard]] std::uint32_t bits_of(BodyId body) const {
    if (body.is_ground()) return 0;
    if (body.instance == 0) return moved[static_cast<std::size_t>(body.link)];
    const auto& held = context->scene().instances()[static_cast<std::size_t>(body.instance)].held;
    return held ? bits_of(held->holder) : 0;
  }
  [[nodiscard]] std::string name_of(BodyId body) const;
  [[nodiscard]] Eigen::VectorXd whole(const ReachQuery& query) const {
    return query.q.size() == model->nq ? query.q : model->neutral();
  }
  [[nodiscard]] bool is_free(const Eigen::VectorXd& q);
  [[nodiscard]] ReachBranch branch(const Eigen::VectorXd& q, IkSolution solution);
  void solve_as(const ReachQuery& query, const Pose& X_WB, IkTask task, ReachAnswer& out);
  void fail(const ReachQuery& query, const Pose& X_WB, IkTask task, ReachAnswer& out);
  [[nodiscard]] IkRequest request_of(const ReachQuery& query, const Pose& X_WB, IkTask task,
                                     const Eigen::VectorXd& q);
  [[nodiscard]] Eigen::VectorXd with_arm(Eigen::VectorXd q, const Eigen::VectorXd& u) const {
    solver.chain().apply(*model, u, q);
    return q;
  }

  std::shared_ptr<const Model> model;
  IkSolver solver;
  Data data;
  std::vector<std::uint32_t> moved;  // [links] moving_variables()
  std::optional<CollisionContext> context;
  std::vector<std::size_t> concerned;  // indices of the scene's tested pairs; the last that touched is first
};

std::string ArmReach::Impl::name_of(BodyId body) const {
  if (body.is_ground()) return "ground";
  const SceneInstance& instance = context->scene().instances()[static_cast<std::size_t>(body.instance)];
  if (instance.model == nullptr) return instance.name;
  const std::string& link = instance.model->links[static_cast<std::size_t>(body.link)].name;
  return body.instance == 0 ? link : instance.name + "/" + link;
}

bool ArmReach::Impl::is_free(const Eigen::VectorXd& q) {
  if (!context) return true;
  context->set_configuration(0, q);
  for (std::size_t i = 0; i < concerned.size(); ++i) {
    if (!context->tested_closer(concerned[i], -kTouching)) continue;
    // Configurations that follow each other often touch with the same pair: it is tested first.
    std::rotate(concerned.begin(), concerned.begin() + static_cast<std::ptrdiff_t>(i),
                concerned.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    return false;
  }
  return true;
}

ReachBranch ArmReach::Impl::branch(const Eigen::VectorXd& q, IkSolution solution) {
  ReachBranch out;
  out.manipulability = manipulability(solver.chain(), solution.u, solver.task_space().freedom);
  out.limit_distance = limit_distance(solver.chain(), solution.u);
  out.solution = std::move(solution);
  out.q = q;
  if (!context) return out;
  context->set_configuration(0, q);
  for (const PairDistance& pair : context->contacts()) {
    if (concerns(pair.a, pair.b))
      out.touching.push_back({name_of(pair.a), name_of(pair.b), std::max(0.0, -pair.distance)});
  }
  if (!out.touching.empty()) {
    out.clearance = 0;
    out.nearest_pair = *std::max_element(out.touching.begin(), out.touching.end(),
                                         [](const auto& a, const auto& b) { return a.depth < b.depth; });
    return out;
  }
  const PairDistance nearest = context->distance(kClearanceSearch);
  if (nearest.distance > kClearanceSearch) return out;
  out.clearance = std::max(0.0, nearest.distance);
  out.nearest_pair = {name_of(nearest.a), name_of(nearest.b), 0};
  return out;
}

IkRequest ArmReach::Impl::request_of(const ReachQuery& query, const Pose& X_WB, IkTask task,
                                     const Eigen::VectorXd& q) {
  IkRequest out;
  out.X_BT = X_WB.inverse(Eigen::Isometry) * query.X_WT;
  out.task = task;
  out.seed = solver.chain().variables_of(*model, q);
  out.position_tolerance = query.position_tolerance;
  out.rotation_tolerance = query.rotation_tolerance;
  out.attempts = query.attempts;
  const bool collides = query.collisions && context;
  if (collides || query.accepts) {
    out.accepts = [this, q, collides, accepts = query.accepts](const Eigen::VectorXd& u) {
      const Eigen::VectorXd whole_q = with_arm(q, u);
      return (!accepts || accepts(whole_q)) && (!collides || is_free(whole_q));
    };
  }
  return out;
}

void ArmReach::Impl::solve_as(const ReachQuery& query, const Pose& X_WB, IkTask task, ReachAnswer& out) {
  const Eigen::VectorXd q = whole(query);
  const IkRequest request = request_of(query, X_WB, task, q);
  std::vector<IkSolution> solutions;
  if (query.every_branch) {
    solutions = solver.solve_all(request);
  } else if (auto solution = solver.solve(request)) {
    solutions.push_back(std::move(*solution));
  }
  for (IkSolution& solution : solutions) {
    const Eigen::VectorXd at_solution = with_arm(q, solution.u);
    out.branches.push_back(branch(at_solution, std::move(solution)));
  }
  out.solved = !out.branches.empty();
  out.task = task;
  if (out.solved && !query.task) out.note = free_rotation_note(task, out.branches.front().solution);
}

void ArmReach::Impl::fail(const ReachQuery& query, const Pose& X_WB, IkTask task, ReachAnswer& out) {
  const Eigen::VectorXd q = whole(query);
  const IkRequest request = request_of(query, X_WB, task, q);
  out.task = task;
  out.failure = explain(solver, request);
  out.message = describe(solver, request, *out.failure);
  out.nearest = branch(with_arm(q, out.failure->nearest.u), out.failure->nearest);
  if (out.failure->obstacle != IkObstacle::refused) {
    const IkSolution& nearest = out.failure->nearest;
    if (solver.task_space().freedom < 6 && task != IkTask::position) {
      out.message += fmt::format("; the least tolerances that would do are {:.3g} mm and {:.3g} deg",
                                 nearest.position_error * 1e3, nearest.rotation_error / kDegree);
    }
    return;
  }
  // All solutions touch; the one that touches the least is named.
  double least = kFarAway;
  for (const IkSolution& solution : out.failure->refused) {
    const ReachBranch touching = branch(with_arm(q, solution.u), solution);
    if (touching.touching.empty() || touching.nearest_pair.depth >= least) continue;
    least = touching.nearest_pair.depth;
    const std::size_t count = out.failure->refused.size();
    out.message =
        fmt::format("{} solution{}, {}: '{}' and '{}' touch by {:.3g} mm{}", count, count == 1 ? "" : "s",
                    count == 1 ? "it touches" : "all of them touch", touching.nearest_pair.a,
                    touching.nearest_pair.b, least * 1e3, count == 1 ? "" : " in the one that touches least");
  }
}

ArmReach::ArmReach(std::shared_ptr<const Model> model, Chain chain,
                   std::shared_ptr<const CollisionScene> scene)
    : impl_(std::make_unique<Impl>(std::move(model), std::move(chain), std::move(scene))) {}
ArmReach::~ArmReach() = default;
ArmReach::ArmReach(ArmReach&&) noexcept = default;

const IkSolver& ArmReach::solver() const {
  return impl_->solver;
}
void ArmReach::set_tool_axis(const Eigen::Vector3d& axis) {
  impl_->solver.set_tool_axis(axis);
}
CollisionContext* ArmReach::context() {
  return impl_->context ? &*impl_->context : nullptr;
}

Pose ArmReach::base_pose(const Eigen::VectorXd& q) const {
  forward_kinematics(*impl_->model, impl_->data, q);
  return impl_->data.X_WL[static_cast<std::size_t>(impl_->solver.chain().base_link)];
}

std::string ArmReach::name_of(BodyId body) const {
  return impl_->name_of(body);
}

bool ArmReach::is_free(const Eigen::VectorXd& q) {
  return impl_->is_free(q);
}

ReachBranch ArmReach::branch_at(const Eigen::VectorXd& q) {
  const Chain& chain = impl_->solver.chain();
  IkRequest request;
  const Eigen::VectorXd u = chain.variables_of(*impl_->model, q);
  request.X_BT = tip_pose(chain, u);
  return impl_->branch(q, impl_->solver.measured(request, u));
}

ReachAnswer ArmReach::answer(const ReachQuery& query) {
  if (query.q.size() != 0 && query.q.size() != impl_->model->nq)
    throw std::invalid_argument("ReachQuery::q has another size than the model's configuration");
  const Pose X_WB = base_pose(impl_->whole(query));
  std::vector<IkTask> tasks{query.task.value_or(IkTask::pose)};
  const int freedom = impl_->solver.task_space().freedom;
  if (!query.task && freedom < 6) tasks.push_back(IkTask::axis);
  if (!query.task && freedom < 4) tasks.push_back(IkTask::position);
  ReachAnswer out;
  for (const IkTask task : tasks) {
    impl_->solve_as(query, X_WB, task, out);
    if (out.solved) return out;
  }
  impl_->fail(query, X_WB, tasks.back(), out);
  return out;
}

namespace {

// Pairs of the robot's own links that may touch, besides those that follow from its structure.
std::vector<AllowedPair> allowed_links(const std::shared_ptr<const CollisionScene>& scene, const Model& model,
                                       const Chain* chain) {
  std::vector<AllowedPair> out;
  SelfCollisionOptions sampling;
  sampling.samples = kAllowedSamples;
  sampling.find_never = false;
  for (const DisabledPair& pair : find_self_collisions(scene, sampling).disabled) {
    const BodyId a{0, pair.link_a}, b{0, pair.link_b};
    if (pair.reason == DisabledReason::adjacent)
      out.push_back({a, b, "they are joined, or only links without shapes are between them"});
    if (pair.reason == DisabledReason::by_default) out.push_back({a, b, "they touch at the start"});
    if (pair.reason == DisabledReason::always) out.push_back({a, b, "they touch always"});
  }
  if (chain == nullptr) return out;
  const std::vector<std::uint32_t> moved = moving_variables(model, *chain);
  for (int a = 0; a < static_cast<int>(moved.size()); ++a) {
    for (int b = a + 1; b < static_cast<int>(moved.size()); ++b) {
      if (moved[static_cast<std::size_t>(a)] == moved[static_cast<std::size_t>(b)])
        out.push_back({{0, a}, {0, b}, "the arm does not move them against each other"});
    }
  }
  return out;
}

}  // namespace

std::shared_ptr<const CollisionScene> reach_scene(const RobotDescription& robot,
                                                  const std::shared_ptr<const Model>& model,
                                                  const Chain* chain, const ReachSurroundings& surroundings,
                                                  Diagnostics& notes) {
  const auto make = [&](CollisionDetail detail) {
    SceneOptions options;
    options.detail = detail;
    options.allowed = surroundings.allowed;
    std::vector<SceneInstance> instances{described_robot(robot, *model)};
    instances.front().model = model;
    instances.insert(instances.end(), surroundings.others.begin(), surroundings.others.end());
    const auto scene = std::make_shared<const CollisionScene>(std::move(instances), std::move(options));
    return scene->allowing(allowed_links(scene, *model, chain));
  };
  try {
    return make(CollisionDetail::triangles);
  } catch (const MissingModule& reason) {
    notes.note("reach.hulls", {}, fmt::format("collisions are checked by convex hulls: {}", reason.what()));
  } catch (const InputError&) {
    notes.note("reach.hulls", {}, "collisions are checked by convex hulls, because a mesh cannot be read");
  }
  return make(CollisionDetail::hulls);
}

}  // namespace doppel
