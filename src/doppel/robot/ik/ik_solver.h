#pragma once
// Inverse kinematics of a chain: configurations whose tip is in a pose.
//
//   const IkSolver arm(model, make_chain(*model, base_link, tip_link));
//   IkRequest request{.X_BT = pose, .seed = u};
//   if (const auto solution = arm.solve(request)) ...
//
// Arms whose axes allow it are solved by sub-problems, which gives all branches; each branch is refined on
// the true arm. All others are searched from many starting points at once (LaneSearch). Every answer is
// within the limits, and its pose is computed again by the model's own forward kinematics.
//
// The same request gives the same bits on every processor. Effort is counted in attempts, never in time.

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/ik/task_space.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/robot/lanes/chain.h"

namespace doppel {

inline constexpr double kIkPositionTolerance = 1e-6;  // m
inline constexpr double kIkRotationTolerance = 1e-6;  // rad
inline constexpr int kIkAttempts = 512;
inline constexpr int kIkBranchAttempts = 64;  // of a search for all branches

struct IkRequest {
  Pose X_BT = Pose::Identity();  // the tip in the base link
  IkTask task = IkTask::pose;
  Eigen::VectorXd seed = {};  // [variables] rad, m; empty: the middle of the limits
  // Wider ones are used where the pose itself cannot be met, and then the position counts most.
  double position_tolerance = kIkPositionTolerance, rotation_tolerance = kIkRotationTolerance;
  int attempts = kIkAttempts;  // of searches; 0: sub-problems alone
  // A configuration [variables] that it refuses is no solution. May be empty.
  std::function<bool(const Eigen::VectorXd&)> accepts = {};
};

struct IkSolution {
  Eigen::VectorXd u;             // [variables] rad, m
  Pose X_BT = Pose::Identity();  // of the tip, by forward_kinematics
  double distance = 0;           // from the seed: the norm of the difference
  double position_error = 0;     // m
  double rotation_error = 0;     // rad, of what the task counts
  double free_rotation = 0;      // rad between the whole rotation and the one that is asked for
};

enum class IkMethod {
  exact,         // by sub-problems: the axes meet or are parallel
  nearly_exact,  // the same, refined on axes that do so only nearly
  numeric,       // searched
};

class DOPPEL_API IkSolver {
 public:
  IkSolver(std::shared_ptr<const Model> model, Chain chain);
  ~IkSolver();
  IkSolver(IkSolver&&) noexcept;

  [[nodiscard]] const Model& model() const;
  [[nodiscard]] const Chain& chain() const;
  [[nodiscard]] const TaskSpace& task_space() const;
  [[nodiscard]] IkMethod method() const;
  // "spherical wrist", "parallel axes 2, 3, 4", "search"; with the misfit of a nearly exact one.
  [[nodiscard]] std::string about_method() const;
  void set_tool_axis(const Eigen::Vector3d& axis);

  // The nearest solution to the seed of those that are found; nullopt: none.
  [[nodiscard]] std::optional<IkSolution> solve(const IkRequest& request) const;
  // All that are found, the nearest to the seed first. Complete by sub-problems; else those of
  // kIkBranchAttempts starting points.
  [[nodiscard]] std::vector<IkSolution> solve_all(const IkRequest& request) const;
  // All branches without limits.
  [[nodiscard]] std::vector<IkSolution> solve_without_limits(const IkRequest& request) const;
  // One solution for each of many poses, by search. `common`: all but pose, seed and accepts. seeds:
  // [targets][variables], or empty. found: [targets].
  void solve_batch(std::span<const Pose> targets, const IkRequest& common, std::span<const double> seeds,
                   std::vector<std::optional<Eigen::VectorXd>>& found) const;
  // The pose within the limits that is nearest to the one that is asked for: at the position, if it can be
  // reached, with the least rotation that is left; else the nearest position.
  [[nodiscard]] IkSolution nearest(const IkRequest& request) const;

  // The solution at u, measured by the model's forward kinematics.
  [[nodiscard]] IkSolution measured(const IkRequest& request, const Eigen::VectorXd& u) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
