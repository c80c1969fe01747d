#pragma once
// Private to the MuJoCo back end: the engine's class; mujoco_engine.cpp has what concerns the robot,
// mujoco_step.cpp how a step is taken, mujoco_start.cpp how the robot stands at the start, mujoco_objects.cpp
// the objects of the world.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <vector>

#include "doppel/physics/drive.h"
#include "doppel/physics/mujoco/mujoco_engine.h"
#include "doppel/physics/mujoco/mujoco_state_detail.h"
#include "doppel/physics/step_scheme.h"

namespace doppel {

struct AppliedWrench {
  bool on = false;
  Eigen::Vector3d p_BoP_B, force_W, torque_W;  // on a body
};

class MujocoEngine final : public Engine {
 public:
  MujocoEngine(const RobotDescription& robot, const Model& model, const World& world,
               const EngineOptions& options, Diagnostics& diagnostics)
      : model_(model),
        world_(world),
        robot_(write_robot(robot, model, world, meshes_, diagnostics)),
        state_(std::make_unique<MujocoState>(robot_, model, world, meshes_, diagnostics)),
        q0_(options.q0.size() > 0 ? options.q0 : model.neutral()),
        q_(model.nq),
        effort_(model.joints.size(), 0.0),
        applied_effort_(static_cast<std::size_t>(model.nv), 0.0),
        rotors_(static_cast<std::size_t>(model.nv), 0.0),
        wrenches_(model.links.size()),
        object_wrenches_(world.objects.size()) {
    if (q0_.size() != model.nq) throw std::invalid_argument("EngineOptions::q0 has the wrong size");
    floating_ = std::any_of(model.joints.begin(), model.joints.end(),
                            [](const ModelJoint& joint) { return joint.type == JointType::floating; });
    any_weightless_ = std::any_of(model.links.begin(), model.links.end(),
                                  [](const ModelLink& link) { return link.weightless; });
    make_drives(options);
    make_springs();
    size_stages();
    if (options.set_on_ground) set_on_ground();
    choose_exclusions(options.self_collision);
    reset();
  }

  [[nodiscard]] EngineCapabilities capabilities() const override {
    const int version = mj_version();
    const int minor_base = version >= 1000 ? 1000000 : 100;  // 222 is 2.2.2; from 3.5 on 3005000 is 3.5.0
    const int minor_unit = version >= 1000 ? 1000 : 10;
    return {fmt::format("mujoco {}.{}.{}", version / minor_base, version % minor_base / minor_unit,
                        version % minor_unit),
            true, true, true};
  }
  [[nodiscard]] const std::vector<ExcludedPair>& excluded_pairs() const override { return excluded_; }
  [[nodiscard]] std::span<const ServoParameters> servos() const override { return servos_; }

  void reset() override;
  void step() override;
  [[nodiscard]] Time time() const override { return steps_ * world_.step; }
  void set_time(Time now) override { steps_ = now / world_.step; }
  [[nodiscard]] bool diverged() const override { return diverged_; }

  [[nodiscard]] std::span<const double> q() const override {
    return {floating_ ? q_.data() : d()->qpos, static_cast<std::size_t>(model_.nq)};
  }
  [[nodiscard]] std::span<const double> v() const override {
    return {d()->qvel, static_cast<std::size_t>(model_.nv)};
  }
  [[nodiscard]] std::span<const double> drive_effort() const override { return effort_; }
  void set_state(std::span<const double> q, std::span<const double> v) override;

  void lift_out_of_ground() override;
  void set_drive(int joint, DriveMode mode) override;
  [[nodiscard]] DriveMode drive(int joint) const override {
    return drive_of_joint_[joint] < 0 ? DriveMode::limp : drives_[drive_of_joint_[joint]].mode();
  }
  void set_target(int joint, double target) override { drives_[drive_of_joint_[joint]].set_target(target); }
  [[nodiscard]] double drive_target(int joint) const override {
    return drive_of_joint_[joint] < 0 ? 0.0 : drives_[drive_of_joint_[joint]].target();
  }
  [[nodiscard]] double drive_reference(int joint) const override {
    return drives_[drive_of_joint_[joint]].reference();
  }
  void set_drive_reference(int joint, double reference) override {
    drives_[drive_of_joint_[joint]].follow(reference);
  }

  void apply_joint_effort(int joint, double effort) override {
    applied_effort_[model_.joints[joint].v] = effort;
  }
  void apply_wrench(int link, const Eigen::Vector3d& p_LoP_L, const Eigen::Vector3d& force_W,
                    const Eigen::Vector3d& torque_W) override {
    wrenches_[link] = {true, p_LoP_L, force_W, torque_W};
    any_wrench_ = true;
  }
  bool apply_object_wrench(std::string_view name, const Eigen::Vector3d& p_OoP_O,
                           const Eigen::Vector3d& force_W, const Eigen::Vector3d& torque_W) override;
  void clear_applied() override;

  [[nodiscard]] Pose link_pose(int link) const override { return body_pose(state_->body_of_link(link)); }
  [[nodiscard]] FrameVelocity link_velocity(int link) const override {
    return body_velocity(state_->body_of_link(link));
  }
  [[nodiscard]] double kinetic_energy() const override { return energy().kinetic; }
  [[nodiscard]] double potential_energy() const override { return energy().potential; }

  void contacts(std::vector<Contact>& out) const override;
  [[nodiscard]] RayHit cast_ray(const Eigen::Vector3d& from_W,
                                const Eigen::Vector3d& direction_W) const override;
  [[nodiscard]] const std::vector<WorldObject>& objects() const override { return world_.objects; }
  bool object_pose(std::string_view name, Pose& X_WO) const override;
  bool object_velocity(std::string_view name, FrameVelocity& velocity) const override;
  bool set_object_pose(std::string_view name, const Pose& X_WO) override;
  bool set_object_velocity(std::string_view name, const FrameVelocity& velocity) override;
  void spawn(const WorldObject& object) override;
  bool remove(std::string_view name) override;
  void set_objects(std::vector<WorldObject> objects) override;

  // What the joint's own damping takes at this instant, which MuJoCo does not count, N m or N.
  [[nodiscard]] double joint_damping_effort(int v) const {
    return v < model_.nv ? joint_damping_[v] * d()->qvel[v] : 0.0;
  }
  void write_present_efforts(mjData& data) const;

  [[nodiscard]] mjModel* m() const { return state_->m(); }
  [[nodiscard]] mjData* d() const { return state_->d(); }

 private:
  struct Energy {
    double potential, kinetic;
  };
  [[nodiscard]] Energy energy() const;
  void make_drives(const EngineOptions& options);
  void make_springs();
  void size_stages();
  double moved_inertia(int joint);
  double inertia_at(int v);
  [[nodiscard]] bool robot_touches() const;
  void pull_back_turns(int i);
  void meet_stop(JointSpring& stop);
  void begin_step();
  bool write_armature();
  void restore_kept();
  void move_by(const std::array<double, kMostStages>& weights, int stages);
  void enter_stage(int i);
  [[nodiscard]] bool implicit_at(int v) const;
  void write_stage_efforts(int i);
  bool solve_stage(int i);
  [[nodiscard]] double asked_effort(std::size_t k) const;
  bool settle(int pass);
  bool take_stages();
  void finish_step();
  void choose_exclusions(bool self_collision);
  void list_exclusions();
  void find_touching();
  bool note_touching(const Contact& contact);
  void set_on_ground();
  bool raise_root(Eigen::VectorXd& q, bool only_out_of_ground);
  double lowest_point() const;
  void add_wrench(int body, const AppliedWrench& wrench);
  void write_wrenches();
  void lift_wrenches();
  bool ran_away() const;
  Pose body_pose(int body) const;
  FrameVelocity body_velocity(int body) const;
  int find_object(std::string_view name) const;
  Contact describe(const mjContact& contact) const;
  void rebuild(World world);
  void carry_over(const MujocoState& old, const World& old_world, MujocoState& fresh,
                  const World& world) const;

  Model model_;
  World world_;
  CollisionMeshes meshes_;
  RobotMjcf robot_;
  std::unique_ptr<MujocoState> state_;
  mutable DataHandle looked_;      // a copy for questions whose answers need computing; made when first asked
  std::vector<Overlap> overlaps_;  // with the ground and objects, at the start
  std::vector<ExcludedPair> excluded_;
  std::vector<ServoParameters> servos_;  // [joints]
  std::vector<Drive> drives_;
  std::vector<int> drive_of_joint_;   // [joints]; -1: none
  std::vector<JointSpring> springs_;  // of the drives, in their order, then of the limit stops
  Eigen::VectorXd q0_;
  Eigen::VectorXd q_;                   // the model's q where MuJoCo's differs from it
  bool floating_ = false;               // it does
  std::vector<double> effort_;          // [joints]
  std::vector<double> kept_;            // MuJoCo's qpos and qvel before the step
  std::vector<double> applied_effort_;  // [nv] from outside
  std::vector<double> joint_damping_;   // [nv]
  std::vector<double> rotors_;          // [nv] inertia of motors commanded by effort
  const StepScheme* scheme_ = nullptr;  // of the present step
  // What J holds of each degree of freedom [nv]; derivatives of the stages; a step's move (tangent vectors).
  std::vector<double> linear_damping_, linear_stiffness_;
  std::array<std::vector<double>, kMostStages> k_q_, k_v_;
  std::vector<double> move_;
  mutable std::vector<double> momentum_;        // [MuJoCo's nv] scratch
  std::vector<int> turning_;                    // first degrees of freedom of free rotations
  std::vector<double> asked_;                   // [springs] law of the stages, weighted
  std::vector<AppliedWrench> wrenches_;         // [links]
  std::vector<AppliedWrench> object_wrenches_;  // [objects]
  bool any_wrench_ = false;
  bool any_weightless_ = false;  // a link that gravity does not pull
  bool diverged_ = false;
  std::int64_t steps_ = 0;
};

}  // namespace doppel
