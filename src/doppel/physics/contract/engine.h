#pragma once
// The contract of a physics engine, in two halves. A CompiledWorld is immutable and shared: the world's
// settings, its instances, and whatever the engine compiled from them. An Engine is a state made from it:
// positions, velocities, drives, applied loads, time. Any number of engines on any number of threads share
// one compilation; each engine is used by one thread at a time.
//
// Functions of an Engine do not allocate or throw unless their comment states it; an index out of range
// throws std::out_of_range. After step() all reported values belong to the same instant.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/base/core/time.h"
#include "doppel/export.h"
#include "doppel/physics/contract/model_instance.h"
#include "doppel/physics/contract/world.h"
#include "doppel/robot/collision/body_id.h"

namespace doppel {

// Largest deviations of an engine from the closed forms and the independent dynamics of the contract tests
// (docs/engines.md lists them).
struct EngineTolerances {
  double period = 1e-4;       // of a pendulum's period, relative, at 1 ms
  double free_fall = 1e-6;    // m after 1 s at 1 ms, beside the integrator's own error
  double holding = 1e-3;      // of the effort that holds a joint against inverse dynamics, relative
  double sag = 1e-3;          // of torque / stiffness, relative
  double stiction = 1e-6;     // rad/s of a joint that friction holds
  double mimic = 1e-4;        // rad by which a loaded mimic joint deviates from its leader
  double penetration = 1e-3;  // m that a box of 1 kg sinks into the ground
};

// The features of an engine. Features that a scenario needs and the engine lacks are reported at the start
// (report_missing_capabilities() in engine_modules.h).
struct EngineCapabilities {
  std::string name, version;  // "mujoco", "2.2.2"
  bool contacts = false, rays = false;
  bool floating = false, planar = false;  // joint types beside the scalar ones
  bool mimics = false, friction = false;  // of joints
  bool stops = false;                     // limit stops with a stiffness
  bool ideal = false;                     // ideal servos
  bool directed_friction = false;         // friction with a direction, and torsion (friction.h)
  bool attachments = false;               // Engine::attach()
  bool heightmaps = false;                // contacts with terrains
  bool bounce = false;                    // contacts with a restitution (CollisionShape)
  std::vector<Integrator> integrators;    // the first is the default
  EngineTolerances tolerances;
};

struct Contact {
  BodyId a, b;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();        // m
  Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();  // unit, from a to b
  Eigen::Vector3d force_W = Eigen::Vector3d::Zero();    // N, on b
  Eigen::Vector3d torque_W = Eigen::Vector3d::Zero();   // N m, on b: of torsion (friction.h)
  double depth = 0;                                     // m, positive: penetrating
  double friction = 0;  // Coulomb, of the pair; the larger of the two where its friction has a direction
};

// Velocity of a frame relative to the world: of its origin and of its rotation, in world axes.
struct FrameVelocity {
  Eigen::Vector3d linear_W = Eigen::Vector3d::Zero();   // m/s
  Eigen::Vector3d angular_W = Eigen::Vector3d::Zero();  // rad/s
};

// Two bodies of different instances that are fixed to each other, on request and until they are detached.
struct DOPPEL_API Attachment {
  BodyId a, b;
  Pose X_AB = Pose::Identity();
  [[nodiscard]] bool joins(BodyId one, BodyId other) const {
    return (a == one && b == other) || (a == other && b == one);
  }
};

struct RayHit {
  double distance = -1;  // m; negative: nothing hit
  BodyId body;
};

// A pair that never collides, and the reason. In a pair of a robot and an object or the ground, `a` is
// the robot's link.
struct ExcludedPair {
  BodyId a, b;
  std::string reason;     // "joined by Revolute 2", "touching at the start", "inside at the start"
  double depth = 0;       // m: how far one lies in the other at the start
  bool at_start = false;  // found at the start; false: follows from the structure
};

// The kind of drive of a scalar joint. Mimic joints are moved by a physical coupling to their leader, never
// by a drive.
enum class DriveMode {
  passive,   // nothing: the joint moves freely
  position,  // a servo holds the target position (servo.h)
  velocity,  // a servo holds the target velocity
  effort,    // the target is the effort, clipped at the limit
};

struct DriveState {
  DriveMode mode = DriveMode::passive;
  // The last accepted target: a position (rad, m), velocity (rad/s, m/s) or effort (N m, N), by the mode.
  // Without one since set_drive(): the position that the drive holds, or 0 in the other modes.
  double target = 0;
  // rad or m: the servo's reference on its way to the target; under load the joint sags behind it.
  double reference = 0;
};

class Engine;

class DOPPEL_API CompiledWorld : public std::enable_shared_from_this<CompiledWorld> {
 public:
  virtual ~CompiledWorld() = default;
  CompiledWorld(const CompiledWorld&) = delete;
  CompiledWorld& operator=(const CompiledWorld&) = delete;

  [[nodiscard]] const WorldSettings& settings() const { return settings_; }
  [[nodiscard]] const std::vector<ModelInstance>& instances() const { return instances_; }
  [[nodiscard]] int find(std::string_view instance) const { return find_instance(instances_, instance); }
  [[nodiscard]] const std::vector<ExcludedPair>& excluded_pairs() const { return excluded_; }
  [[nodiscard]] virtual const EngineCapabilities& capabilities() const = 0;
  // The name of a body in messages: "ground", an object's name, or a link's.
  [[nodiscard]] const std::string& name_of(BodyId body) const;

  // A state at reset: every instance at q0, at rest, time 0, drives passive. Throws std::bad_alloc only.
  [[nodiscard]] virtual std::unique_ptr<Engine> make_engine() const = 0;
  // The same settings with other instances. Pairs that are excluded because they touched at the start stay
  // excluded while both instances keep their names and models; pairs of new instances are determined as at a
  // start. Throws InputError. Any thread.
  [[nodiscard]] virtual std::shared_ptr<const CompiledWorld> with(std::vector<ModelInstance> instances,
                                                                  Diagnostics& diagnostics) const = 0;

 protected:
  // Places instances with ModelInstance::set_on_ground on the ground. Throws InputError: two instances of one
  // name, or an instance named "ground".
  CompiledWorld(WorldSettings settings, std::vector<ModelInstance> instances);
  std::vector<ExcludedPair> excluded_;  // filled by the engine from its Exclusions (exclusions.h)

 private:
  WorldSettings settings_;
  std::vector<ModelInstance> instances_;
};

// One instance's state in an engine: a handle to copy. Valid until the engine's instances change.
class DOPPEL_API Instance {
 public:
  Instance() = default;
  Instance(Engine& engine, int index) : engine_(&engine), index_(index) {}
  [[nodiscard]] Engine& engine() { return *engine_; }
  [[nodiscard]] const Engine& engine() const { return *engine_; }
  [[nodiscard]] int index() const { return index_; }
  [[nodiscard]] const ModelInstance& made_of() const;
  [[nodiscard]] const Model& model() const { return *made_of().model; }
  [[nodiscard]] const std::string& name() const { return made_of().name; }

  // Indexed as in Model.
  [[nodiscard]] std::span<const double> q() const;  // [nq] rad, m
  [[nodiscard]] std::span<const double> v() const;  // [nv] rad/s, m/s
  // Effort of each joint's drive in the last step [joints]; 0 where passive or not scalar. N m or N.
  [[nodiscard]] std::span<const double> drive_effort() const;
  // Writes the whole state, q [nq] and v [nv]; drives' references follow q, so that no joint moves back.
  // Mimics are set from their leaders. What is attached to its links, directly or by other instances, and
  // moves freely is placed along with them, at rest: each instance once. Allocates if the engine has
  // attachments.
  void set_state(std::span<const double> q, std::span<const double> v);
  // Pose of links[0] in the world; part of the state, because a fixed object or base may be moved.
  [[nodiscard]] const Pose& root_pose() const;  // X_WR
  void set_root_pose(const Pose& X_WR);
  // Places the base link at rest: a floating one by its joint, a fixed one by its root.
  void place(const Pose& X_WB);
  // Velocity of a floating base; no effect on a fixed one.
  void set_base_velocity(const FrameVelocity& velocity);
  // Lifts a floating joint from the root until no shape of the instance is below the ground. Allocates.
  void lift_out_of_ground();

  // Switching to position or velocity starts from the joint's present position. Precondition: joints[joint]
  // is scalar and no mimic.
  void set_drive(int joint, DriveMode mode);
  [[nodiscard]] DriveState drive_state(int joint) const;  // of a mimic: passive
  [[nodiscard]] DriveMode drive(int joint) const { return drive_state(joint).mode; }
  // In the unit of the drive's mode (DriveState::target). A target that is not finite is ignored.
  void set_target(int joint, double target);
  [[nodiscard]] double drive_target(int joint) const { return drive_state(joint).target; }
  [[nodiscard]] double drive_reference(int joint) const { return drive_state(joint).reference; }
  void set_drive_reference(int joint, double reference);

  // Other parameters of a joint's servo, from the next step on, until reset(): of a device whose limits
  // change while it runs. Precondition: as for set_drive(); not `ideal`.
  void set_servo(int joint, const ServoParameters& servo);

  // External effort (N m, N) on a scalar joint and external wrench on a link: a force (N, world axes) at the
  // point p_LoP_L (m, link frame) and a torque (N m, world axes). Both act until clear_applied(); a second
  // one on the same joint or link replaces the first. No effect on a fixed body.
  void apply_joint_effort(int joint, double effort);
  void apply_wrench(int link, const Eigen::Vector3d& p_LoP_L, const Eigen::Vector3d& force_W,
                    const Eigen::Vector3d& torque_W);

  [[nodiscard]] Pose link_pose(int link) const;  // X_WL
  [[nodiscard]] FrameVelocity link_velocity(int link) const;
  [[nodiscard]] Pose base_pose() const { return link_pose(made_of().base_link()); }
  [[nodiscard]] FrameVelocity base_velocity() const { return link_velocity(made_of().base_link()); }

 private:
  // Throw std::out_of_range.
  [[nodiscard]] int checked_joint(int joint) const;
  [[nodiscard]] int checked_drive(int joint) const;
  [[nodiscard]] int checked_link(int link) const;
  Engine* engine_ = nullptr;
  int index_ = -1;
};

class DOPPEL_API Engine {
 public:
  virtual ~Engine() = default;
  Engine& operator=(const Engine&) = delete;

  [[nodiscard]] const CompiledWorld& world() const { return *world_; }
  [[nodiscard]] const std::shared_ptr<const CompiledWorld>& compiled() const { return world_; }
  // Throws std::out_of_range.
  [[nodiscard]] Instance instance(int index);
  [[nodiscard]] const Instance instance(int index) const;
  // nullopt: no instance has this name.
  [[nodiscard]] std::optional<Instance> find(std::string_view name);
  [[nodiscard]] std::optional<const Instance> find(std::string_view name) const;

  // Another state of the same compilation, bit-identical to this one. Allocates.
  [[nodiscard]] virtual std::unique_ptr<Engine> clone() const = 0;
  // Bytes that a clone takes, about; 0: few.
  [[nodiscard]] virtual std::size_t state_bytes() const { return 0; }
  // Becomes bit-identical to `from`. Throws std::invalid_argument if `from` has another compilation.
  // Allocates if `from` has more attachments.
  virtual void copy_state(const Engine& from) = 0;

  // Back to q0, at rest, time 0, all drives passive, no applied loads, no attachments, every root at its
  // X_WR.
  virtual void reset() = 0;
  // One step of WorldSettings::step.
  virtual void step() = 0;
  [[nodiscard]] virtual Time time() const = 0;  // steps since reset, exact
  // Continues to count from the last whole step before `now`, as after the replacement of another engine.
  virtual void set_time(Time now) = 0;
  // True from the first step whose result is not finite or too large. That step and all later ones leave
  // state and time unchanged.
  [[nodiscard]] virtual bool diverged() const = 0;
  // Contacts and constraint rows since the last reset for which the engine had no room. Bodies may have sunk
  // into each other there.
  [[nodiscard]] virtual std::int64_t dropped_contacts() const { return 0; }
  virtual void clear_applied() = 0;  // joint efforts and wrenches on all instances

  // Fixes body b to body a as they are now. They no longer touch each other. Refused: the engine cannot, both
  // belong to one instance, no joint above either of them moves, or they are attached already. Throws
  // std::out_of_range. Allocates.
  Status attach(BodyId a, BodyId b);
  // In either order. False: they are not attached.
  bool detach(BodyId a, BodyId b);
  [[nodiscard]] const std::vector<Attachment>& attachments() const { return attachments_; }

  // Sums over all moving bodies.
  [[nodiscard]] virtual double kinetic_energy() const = 0;    // J
  [[nodiscard]] virtual double potential_energy() const = 0;  // J, zero at z = 0

  // Replaces the content of `out` by the contacts of the present state. May allocate.
  virtual void contacts(std::vector<Contact>& out) const = 0;
  // The first surface on the ray from from_W (m, world frame) along direction_W (world axes). direction_W
  // need not have unit length; a zero vector hits nothing.
  [[nodiscard]] virtual RayHit cast_ray(const Eigen::Vector3d& from_W,
                                        const Eigen::Vector3d& direction_W) const = 0;

  // Compiles (and allocates), then continues with other instances: an instance that keeps its name and
  // model keeps its state, drives, loads and attachments. These throw InputError, as for a name that is
  // already used; the engine is then unchanged.
  void set_instances(std::vector<ModelInstance> instances);
  // The same with a compilation that world().with() made beforehand, on any thread.
  void continue_with(std::shared_ptr<const CompiledWorld> world);
  void spawn(ModelInstance instance);
  bool remove(std::string_view name);  // false: no such instance

 protected:
  explicit Engine(std::shared_ptr<const CompiledWorld> world) : world_(std::move(world)) {}
  Engine(const Engine&) = default;
  Engine(Engine&&) = default;
  Engine& operator=(Engine&&) = default;

  // Becomes a state of `world`. kept: for each instance of `world`, the instance of this engine whose state
  // it keeps, or -1. Time continues. If it throws, the engine is unchanged.
  virtual void become(std::shared_ptr<const CompiledWorld> world, std::span<const int> kept) = 0;
  // Takes over attachments_, which have changed. Called only with EngineCapabilities::attachments.
  virtual void apply_attachments() {}
  std::shared_ptr<const CompiledWorld> world_;
  std::vector<Attachment> attachments_;

 private:
  friend class Instance;
  void carry_attached(int instance);
  void write_base(int instance, const Pose& X_WB);
  [[nodiscard]] bool can_move(BodyId body) const;
  [[nodiscard]] Pose pose_of(BodyId body) const;
  // Called with indices that are in range; units and frames are those of Instance.
  [[nodiscard]] virtual std::span<const double> q_of(int instance) const = 0;
  [[nodiscard]] virtual std::span<const double> v_of(int instance) const = 0;
  [[nodiscard]] virtual std::span<const double> drive_effort_of(int instance) const = 0;
  virtual void write_state(int instance, std::span<const double> q, std::span<const double> v) = 0;
  [[nodiscard]] virtual const Pose& root_pose_of(int instance) const = 0;
  virtual void write_root_pose(int instance, const Pose& X_WR) = 0;
  virtual void start_drive(int instance, int joint, DriveMode mode) = 0;
  [[nodiscard]] virtual DriveState drive_of(int instance, int joint) const = 0;
  virtual void write_target(int instance, int joint, double target) = 0;
  virtual void write_servo(int instance, int joint, const ServoParameters& servo) = 0;
  virtual void write_reference(int instance, int joint, double reference) = 0;
  virtual void write_joint_effort(int instance, int joint, double effort) = 0;
  virtual void write_wrench(int instance, int link, const Eigen::Vector3d& p_LoP_L,
                            const Eigen::Vector3d& force_W, const Eigen::Vector3d& torque_W) = 0;
  [[nodiscard]] virtual Pose pose_of(int instance, int link) const = 0;
  [[nodiscard]] virtual FrameVelocity velocity_of(int instance, int link) const = 0;
};

}  // namespace doppel
