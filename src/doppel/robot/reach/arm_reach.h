#pragma once
// Inverse kinematics of an arm of a robot, with its collisions: what answers `doppel ik`, compute_ik and the
// page's tool drag. Poses are in the frame W of the model's root link unless their name says otherwise.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/collision/collision_scene.h"
#include "doppel/robot/ik/ik_failure.h"
#include "doppel/robot/ik/ik_solver.h"

namespace doppel {

struct ReachQuery {
  Pose X_WT = Pose::Identity();  // of the tip
  // nullopt: as much of the pose as the arm has joints for. Six: all of it. Four or five: all of it, else the
  // position with the tool's axis. Three: with less, the position alone.
  std::optional<IkTask> task = {};
  Eigen::VectorXd q = {};  // [nq] the whole robot: where the other joints are, and the seed; empty: neutral
  double position_tolerance = kIkPositionTolerance, rotation_tolerance = kIkRotationTolerance;
  bool collisions = true;  // false: solutions may touch
  bool every_branch = false;
  int attempts = kIkAttempts;  // IkRequest::attempts
  // A configuration [nq] that it refuses is no solution. May be empty.
  std::function<bool(const Eigen::VectorXd&)> accepts = {};
};

struct TouchingLinks {
  std::string a, b;
  double depth = 0;  // m
};

struct ReachBranch {
  IkSolution solution;
  Eigen::VectorXd q;            // [nq]
  double clearance = kFarAway;  // m to the nearest other body; 0: it touches; kFarAway: nothing within 0.5 m
  TouchingLinks nearest_pair;   // of the clearance
  std::vector<TouchingLinks> touching;
  double manipulability = 0;  // manipulability()
  double limit_distance = 0;  // limit_distance()
};

struct ReachAnswer {
  bool solved = false;
  IkTask task = IkTask::pose;  // what is met, or what was tried last
  // The nearest to the seed first; all of them for every_branch.
  std::vector<ReachBranch> branches;
  std::string note;  // "the rotation about the tool's axis is free: 34.2 deg from the request", or empty
  // Without a solution:
  std::optional<IkFailure> failure;
  std::string message;  // a sentence without a full stop, with the least tolerances for a small arm
  std::optional<ReachBranch> nearest;  // the nearest pose that works
};

// For one thread.
class DOPPEL_API ArmReach {
 public:
  // `scene`: instance 0 is the robot; nullptr: nothing collides.
  ArmReach(std::shared_ptr<const Model> model, Chain chain, std::shared_ptr<const CollisionScene> scene);
  ~ArmReach();
  ArmReach(ArmReach&&) noexcept;

  [[nodiscard]] const IkSolver& solver() const;
  void set_tool_axis(const Eigen::Vector3d& axis);
  // The collisions' context, for objects that move.
  [[nodiscard]] CollisionContext* context();

  [[nodiscard]] ReachAnswer answer(const ReachQuery& query);
  // The base of the chain at q [nq].
  [[nodiscard]] Pose base_pose(const Eigen::VectorXd& q) const;
  // The branch of a configuration: its clearance and measures.
  [[nodiscard]] ReachBranch branch_at(const Eigen::VectorXd& q);
  // False: bodies that the arm moves against each other touch.
  [[nodiscard]] bool is_free(const Eigen::VectorXd& q);
  // "link", "robot/link" of another instance, "ground".
  [[nodiscard]] std::string name_of(BodyId body) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The bodies around a robot in its scene. Poses are in the robot's root link.
struct ReachSurroundings {
  std::vector<SceneInstance> others = {};  // instances 1 and up: objects, other robots, what the robot holds
  std::vector<AllowedPair> allowed = {};   // besides those below
};

// The collision scene of a robot, which is instance 0, by its meshes' triangles where they can be read and
// the module for them is there, else by hulls. Pairs of its links are allowed if they touch always or at the
// start, or if only links without shapes are between them, and with `chain` those that the chain does not
// move against each other, each with its reason.
DOPPEL_API std::shared_ptr<const CollisionScene> reach_scene(const RobotDescription& robot,
                                                             const std::shared_ptr<const Model>& model,
                                                             const Chain* chain,
                                                             const ReachSurroundings& surroundings,
                                                             Diagnostics& notes);

}  // namespace doppel
