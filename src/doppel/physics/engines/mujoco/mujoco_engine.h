#pragma once
// Private to the MuJoCo back end: a state of a compiled world; mujoco_engine.cpp reads and writes it,
// mujoco_step.cpp integrates a step.

#include <array>
#include <memory>
#include <vector>

#include "doppel/physics/contract/step_scheme.h"
#include "doppel/physics/engines/mujoco/mujoco_world.h"
#include "doppel/physics/engines/mujoco/state_data.h"

namespace doppel {

struct AppliedWrench {
  bool on = false;
  Eigen::Vector3d p_BoP_B, force_W, torque_W;  // on a body
};

// The compiled model with copies of the arrays that belong to the state: the armature that makes springs
// implicit, the poses of roots, and the couplings while something is attached. All else is shared, and
// outlives it.
class ModelView {
 public:
  explicit ModelView(const mjModel& shared);
  ModelView(const ModelView& other);
  ModelView& operator=(const ModelView& other);  // of the same model
  ModelView(ModelView&&) = default;              // moved vectors keep their memory
  ModelView& operator=(ModelView&&) = default;
  ~ModelView() = default;
  [[nodiscard]] mjModel* get() { return &model_; }
  [[nodiscard]] const mjModel* get() const { return &model_; }

  // Two of MuJoCo's bodies that are fixed to each other.
  struct Weld {
    int a = 0, b = 0;
    Pose X_AB = Pose::Identity();
  };
  // Instead of the former ones.
  void set_welds(std::span<const Weld> welds, double step);

 private:
  struct Couplings {
    std::vector<int> type, first, second;
    std::vector<mjtByte> active;
    std::vector<double> solref, solimp, data;
  };
  void point();
  const mjModel* shared_;
  mjModel model_;
  Couplings couplings_;  // empty: those of the shared model
  std::vector<double> armature_, positions_, rotations_;
};

// The number of MuJoCo's warnings of a state or an acceleration that is not finite or too large.
inline constexpr int kRunaway[] = {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC};

class MujocoEngine final : public Engine {
 public:
  explicit MujocoEngine(std::shared_ptr<const MujocoWorld> world);
  MujocoEngine(const MujocoEngine& other);
  MujocoEngine(MujocoEngine&&) = default;
  MujocoEngine& operator=(MujocoEngine&&) = default;
  MujocoEngine& operator=(const MujocoEngine&) = delete;
  ~MujocoEngine() override = default;

  [[nodiscard]] std::unique_ptr<Engine> clone() const override;
  [[nodiscard]] std::size_t state_bytes() const override { return static_cast<std::size_t>(data_->nbuffer); }
  void copy_state(const Engine& from) override;
  void reset() override;
  void step() override;
  [[nodiscard]] Time time() const override { return Time(steps_ * settings().step); }
  void set_time(Time now) override { steps_ = now.time_since_epoch() / settings().step; }
  [[nodiscard]] bool diverged() const override { return diverged_; }
  [[nodiscard]] std::int64_t dropped_contacts() const override;
  void clear_applied() override;
  [[nodiscard]] double kinetic_energy() const override;
  [[nodiscard]] double potential_energy() const override;
  void contacts(std::vector<Contact>& out) const override;
  [[nodiscard]] RayHit cast_ray(const Eigen::Vector3d& from_W,
                                const Eigen::Vector3d& direction_W) const override;

  // -- for the benchmark and for tests against independent dynamics
  // Effort of the joint's damping at this instant, which is not part of MuJoCo's model, N m or N.
  [[nodiscard]] double joint_damping_effort(int v) const {
    return compiled_world().joint_damping[static_cast<std::size_t>(v)] * d()->qvel[v];
  }
  void write_present_efforts(mjData& data) const;
  [[nodiscard]] const MujocoWorld& compiled_world() const { return static_cast<const MujocoWorld&>(world()); }
  [[nodiscard]] mjModel* m() { return view_.get(); }
  [[nodiscard]] const mjModel* m() const { return view_.get(); }
  [[nodiscard]] mjData* d() const { return data_.get(); }

 private:
  void become(std::shared_ptr<const CompiledWorld> world, std::span<const int> kept) override;
  void apply_attachments() override;
  void write_welds();
  [[nodiscard]] std::span<const double> q_of(int instance) const override;
  [[nodiscard]] std::span<const double> v_of(int instance) const override;
  [[nodiscard]] std::span<const double> drive_effort_of(int instance) const override;
  void write_state(int instance, std::span<const double> q, std::span<const double> v) override;
  [[nodiscard]] const Pose& root_pose_of(int instance) const override {
    return roots_[static_cast<std::size_t>(instance)];
  }
  void write_root_pose(int instance, const Pose& X_WR) override;
  void start_drive(int instance, int joint, DriveMode mode) override;
  [[nodiscard]] DriveState drive_of(int instance, int joint) const override;
  void write_target(int instance, int joint, double target) override;
  void write_servo(int instance, int joint, const ServoParameters& servo) override;
  void write_reference(int instance, int joint, double reference) override;
  void write_joint_effort(int instance, int joint, double effort) override;
  void write_wrench(int instance, int link, const Eigen::Vector3d& p_LoP_L, const Eigen::Vector3d& force_W,
                    const Eigen::Vector3d& torque_W) override;
  [[nodiscard]] Pose pose_of(int instance, int link) const override;
  [[nodiscard]] FrameVelocity velocity_of(int instance, int link) const override;

  [[nodiscard]] const WorldSettings& settings() const { return world().settings(); }
  // Index of the joint's drive; -1: it has none.
  [[nodiscard]] int drive_index(int instance, int joint) const;
  void carry_over(const MujocoEngine& from, int instance, int before);
  void put_root(int instance, const Pose& X_WR);
  bool refresh();
  void read_q() { read_qpos(d()->qpos, compiled_world().quaternions, q_); }
  [[nodiscard]] Pose body_pose(int body) const;
  void add_wrench(int body, const AppliedWrench& wrench);
  void write_wrenches();
  [[nodiscard]] bool ran_away() const;

  // -- mujoco_step.cpp
  [[nodiscard]] double moved_inertia(const CompiledStop& stop);
  [[nodiscard]] double inertia_at(int v);
  [[nodiscard]] bool robot_touches() const;
  void pull_back_turns(int i);
  void add_gyroscopic_corrections();
  void meet_stop(std::size_t index);
  void begin_step();
  bool write_armature();
  void restore_kept();
  void move_by(const std::array<double, kMaxStages>& weights, int stages);
  void enter_stage(int i);
  [[nodiscard]] bool implicit_at(int v) const;
  void write_stage_efforts(int i);
  bool solve_stage(int i);
  [[nodiscard]] double asked_effort(std::size_t k) const;
  void read_wanted();
  bool settle(int pass);
  bool take_stages();
  void finish_step();
  void leave_at_last_state();

  ModelView view_;
  DataHandle data_;
  mutable DataHandle looked_;  // a copy in which const functions compute; made at first use
  mutable IslandSolver islands_;
  std::vector<Pose> roots_;  // [instances] X_WR
  std::vector<Drive> drives_;
  std::vector<JointSpring> springs_;    // of the drives, in their order, then of the limit stops
  std::vector<double> q_;               // [nq] as the models have it
  std::vector<double> effort_;          // [joints of all instances]
  std::vector<double> kept_;            // MuJoCo's qpos, qvel and qacc_warmstart before the step
  std::vector<double> applied_effort_;  // [nv] from outside
  std::vector<double> rotors_;          // [nv] inertia of motors
  const StepScheme* scheme_ = nullptr;  // of the present step
  // Diagonal of J for each degree of freedom [nv]; derivatives of the stages; move of a
  // step (tangent vectors).
  std::vector<double> linear_damping_, linear_stiffness_;
  std::array<std::vector<double>, kMaxStages> k_q_, k_v_;
  std::vector<double> move_;
  std::vector<double> references_;        // [njmax] of the constraints, before slip is subtracted
  mutable std::vector<double> momentum_;  // [nv] scratch
  std::vector<double> asked_, wanted_;    // [springs] law of the stages, weighted; effort without bounds
  std::vector<AppliedWrench> wrenches_;   // [MuJoCo's bodies]
  bool any_wrench_ = false;
  bool diverged_ = false;
  std::int64_t steps_ = 0;
};

}  // namespace doppel
