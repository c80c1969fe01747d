#pragma once
// Scratch of one engine, in which a step is computed from the states of its instances. It keeps nothing
// between steps: a step is a function of the states alone.

#include <memory>
#include <vector>

#include "doppel/physics/engines/bullet/bullet_world.h"
#include "doppel/physics/engines/bullet/constraint_solver.h"

namespace doppel {

struct LinkWrench {
  bool on = false;
  Eigen::Vector3d p_LoP_L, force_W, torque_W;
};

// The whole state of one instance, without compiled data.
struct InstanceState {
  Pose X_WR = Pose::Identity();
  std::vector<double> q, v;
  std::vector<double> effort;   // [joints] of the drives
  std::vector<double> applied;  // [nv] from outside
  std::vector<double> rotors;   // [nv] inertia of motors
  std::vector<Drive> drives;
  std::vector<JointSpring> springs;  // of the drives, then of the stops
  std::vector<LinkWrench> wrenches;  // [links]
};

class StepSolver {
 public:
  explicit StepSolver(const BulletWorld& world);
  StepSolver(const StepSolver&) = delete;
  StepSolver& operator=(const StepSolver&) = delete;

  // Sets the frames and velocities of an instance from its state.
  void load(int instance, const InstanceState& state);
  // Computes velocities and efforts at the end of a step, and chooses the springs' bounds. Precondition: the
  // springs' laws are written and the states of the step's start are loaded. False: the step diverged.
  bool solve(std::vector<InstanceState>& states);
  // Writes positions and velocities of the step's end to the states, after solve().
  void integrate(std::vector<InstanceState>& states) const;
  // After solve().
  void contacts(std::vector<Contact>& out);

  [[nodiscard]] Pose link_pose(int instance, int link, const InstanceState& state) const;
  [[nodiscard]] FrameVelocity link_velocity(int instance, int link) const;
  [[nodiscard]] RayHit cast_ray(const Eigen::Vector3d& from_W, const Eigen::Vector3d& direction_W,
                                const std::vector<InstanceState>& states) const;
  [[nodiscard]] double kinetic_energy() const;
  [[nodiscard]] double potential_energy() const;

 private:
  struct TreeScratch {
    int instance;
    TreeDynamics dynamics;
    Eigen::VectorXd bare_acceleration, acceleration, velocity;
    Eigen::MatrixXd bare_inverse, inverse;  // of the mass matrix, without and with implicit terms
  };
  [[nodiscard]] const BulletInstance& compiled(int instance) const {
    return world_.compiled()[static_cast<std::size_t>(instance)];
  }
  [[nodiscard]] TreeScratch& tree_at(int instance, int tree) {
    return *trees_[static_cast<std::size_t>(first_tree_[static_cast<std::size_t>(instance)] + tree)];
  }
  [[nodiscard]] const TreeScratch& tree_at(int instance, int tree) const {
    return *trees_[static_cast<std::size_t>(first_tree_[static_cast<std::size_t>(instance)] + tree)];
  }
  [[nodiscard]] ArticulationPlace place_of(int instance, int v) const {
    return compiled(instance).articulation.places[static_cast<std::size_t>(v)];
  }
  [[nodiscard]] Pose group_pose(int instance, int group, const Pose& X_WR) const;
  void make_colliders();
  void find_contacts(const std::vector<InstanceState>& states);
  void write_loads(int instance, const InstanceState& state);
  void add_floating_damping(int instance);
  void add_gyroscopic_corrections(int instance);
  void meet_stops(int instance, InstanceState& state);
  void respond(int instance, const InstanceState& state);
  void add_implicit(int instance, int v, double armature);
  void couple_mimics(int instance, const InstanceState& state);
  void write_rows(int instance, const InstanceState& state);
  void write_joint_rows(int instance, const InstanceState& state, const ModelJoint& joint);
  [[nodiscard]] double end_velocity(int instance, int v) const;
  [[nodiscard]] double asked_effort(int instance, const InstanceState& state,
                                    const JointSpring& spring) const;
  bool settle(std::vector<InstanceState>& states, int pass);
  [[nodiscard]] bool finite() const;
  void report_efforts(int instance, InstanceState& state) const;

  const BulletWorld& world_;
  double step_;
  std::vector<std::unique_ptr<TreeScratch>> trees_;
  std::vector<int> first_tree_;  // [instances]
  BulletScratch scratch_;
  std::vector<std::unique_ptr<btCollisionObject>> colliders_;
  std::vector<std::vector<btCollisionObject*>> collider_of_group_;  // [instances][groups]
  btCollisionObject ground_;
  std::unique_ptr<ContactFinder> finder_;
  std::vector<Pose> piece_poses_;
  std::vector<btCollisionObject*> bodies_;
  std::vector<JointRow> rows_;
  std::vector<double> wanted_;  // efforts of one instance's springs without bounds
  std::vector<SolverTree> solver_trees_;
  ConstraintSolver solver_;
};

}  // namespace doppel
