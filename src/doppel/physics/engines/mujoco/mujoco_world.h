#pragma once
// Private to the MuJoCo back end: the compiled world, which states share. It is immutable once it is shared.

#include <array>
#include <utility>
#include <vector>

#include "doppel/physics/contract/detail/joint_springs.h"
#include "doppel/physics/contract/engine_modules.h"
#include "doppel/physics/engines/mujoco/compiled.h"
#include "doppel/physics/engines/mujoco/contact_rules.h"
#include "doppel/physics/engines/mujoco/engine_model.h"

namespace doppel {

// A stop with a stiffness, in MuJoCo's indices, and the joints coupled to it by mimics.
struct CompiledStop {
  JointSpring spring;
  double restitution = 0;
  std::vector<std::pair<int, double>> moved;  // coupled degrees of freedom and their velocity ratios
};

// A link on which gravity does not act.
struct WeightlessBody {
  int body = 0;
  double mass = 0;                                // kg
  Eigen::Vector3d com = Eigen::Vector3d::Zero();  // in the link, m
};

// The one body of an instance that moves freely.
struct LooseBody {
  int body = 0, turn = 0;  // MuJoCo's body; its first degree of freedom of rotation
};

class MujocoWorld final : public CompiledWorld {
 public:
  // `before`: the world whose pairs that touched at the start stay excluded; may be nullptr. Throws
  // InputError with the user's names where MuJoCo rejects the model.
  MujocoWorld(WorldSettings settings, std::vector<ModelInstance> instances, const CompiledWorld* before,
              Diagnostics& diagnostics);

  [[nodiscard]] const EngineCapabilities& capabilities() const override;
  [[nodiscard]] std::unique_ptr<Engine> make_engine() const override;
  [[nodiscard]] std::shared_ptr<const CompiledWorld> with(std::vector<ModelInstance> instances,
                                                          Diagnostics& diagnostics) const override;

  [[nodiscard]] const mjModel* m() const { return model_.get(); }
  [[nodiscard]] const InstanceOffsets& offsets(int instance) const {
    return offsets_[static_cast<std::size_t>(instance)];
  }
  [[nodiscard]] int mujoco_body(int instance, int link) const {
    return bodies_[static_cast<std::size_t>(offsets(instance).link + link)];
  }
  [[nodiscard]] BodyId body_of(int mujoco_body) const { return ids_[static_cast<std::size_t>(mujoco_body)]; }
  [[nodiscard]] const ModelInstance& instance(int index) const {
    return instances()[static_cast<std::size_t>(index)];
  }
  [[nodiscard]] Contact describe(const mjContact& contact) const;

  // Of all instances, in MuJoCo's indices.
  int joints = 0;
  std::vector<Drive> drives;         // as they start
  std::vector<JointSpring> springs;  // of the drives
  std::vector<int> drive_of_joint;   // -1: none
  std::vector<CompiledStop> stops;
  std::vector<double> joint_damping;  // [nv] N m s/rad or N s/m
  std::vector<int> turning;           // first degrees of freedom of free rotations
  std::vector<LooseBody> loose;
  std::vector<int> quaternions;  // their indices in q
  std::vector<WeightlessBody> weightless;
  ContactRules contact_rules;
  Bounces bounces;
  IslandLayout islands;

 private:
  void compile(const MjcfDocument& document, Diagnostics& diagnostics);
  void number_bodies();
  void collect_joints();
  void collect_contact_rules();
  void collect_stops(int instance);
  void couple_mimics(int instance);
  void find_exclusions(Exclusions& exclusions, const CompiledWorld* before,
                       const std::vector<std::pair<BodyId, BodyId>>& excludable);
  void apply(const Exclusions& exclusions, const std::vector<std::pair<BodyId, BodyId>>& excludable,
             const std::vector<int>& signatures);

  ModelHandle model_;
  std::vector<InstanceOffsets> offsets_;
  std::vector<int> bodies_;  // MuJoCo's, of each link of all instances
  std::vector<BodyId> ids_;  // of MuJoCo's bodies
};

// Converts q of the models, from index `first`, to MuJoCo's qpos and back: quaternions are normalised and in
// the order w x y z in MuJoCo.
void write_qpos(std::span<const double> q, int first, std::span<const int> quaternions, double* qpos);
void read_qpos(const double* qpos, std::span<const int> quaternions, std::span<double> q);

}  // namespace doppel
