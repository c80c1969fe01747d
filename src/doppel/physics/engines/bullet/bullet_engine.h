#pragma once
// A state of a world compiled for Bullet.

#include <memory>
#include <vector>

#include "doppel/physics/engines/bullet/step_solver.h"

namespace doppel {

class BulletEngine final : public Engine {
 public:
  explicit BulletEngine(std::shared_ptr<const BulletWorld> world);

  [[nodiscard]] std::unique_ptr<Engine> clone() const override;
  void copy_state(const Engine& from) override;
  void reset() override;
  void step() override;
  [[nodiscard]] Time time() const override { return Time(steps_ * world().settings().step); }
  void set_time(Time now) override { steps_ = now.time_since_epoch() / world().settings().step; }
  [[nodiscard]] bool diverged() const override { return diverged_; }
  void clear_applied() override;
  [[nodiscard]] double kinetic_energy() const override { return solver_->kinetic_energy(); }
  [[nodiscard]] double potential_energy() const override { return solver_->potential_energy(); }
  void contacts(std::vector<Contact>& out) const override;
  [[nodiscard]] RayHit cast_ray(const Eigen::Vector3d& from_W,
                                const Eigen::Vector3d& direction_W) const override;

 private:
  void become(std::shared_ptr<const CompiledWorld> world, std::span<const int> kept) override;
  [[nodiscard]] std::span<const double> q_of(int instance) const override { return at(instance).q; }
  [[nodiscard]] std::span<const double> v_of(int instance) const override { return at(instance).v; }
  [[nodiscard]] std::span<const double> drive_effort_of(int instance) const override {
    return at(instance).effort;
  }
  void write_state(int instance, std::span<const double> q, std::span<const double> v) override;
  [[nodiscard]] const Pose& root_pose_of(int instance) const override { return at(instance).X_WR; }
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

  [[nodiscard]] const BulletWorld& bullet_world() const { return static_cast<const BulletWorld&>(world()); }
  [[nodiscard]] InstanceState& at(int instance) { return states_[static_cast<std::size_t>(instance)]; }
  [[nodiscard]] const InstanceState& at(int instance) const {
    return states_[static_cast<std::size_t>(instance)];
  }
  // Null: the joint has none.
  [[nodiscard]] const Drive* find_drive(int instance, int joint) const;
  [[nodiscard]] Drive& drive_at(int instance, int joint);
  void reset(int instance);
  void load_all() const;

  std::vector<InstanceState> states_;
  std::unique_ptr<StepSolver> solver_;  // scratch: const functions use it without changing the state
  bool diverged_ = false;
  std::int64_t steps_ = 0;
};

}  // namespace doppel
