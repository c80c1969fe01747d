#pragma once
// The contract of a physics engine, in two halves. A CompiledWorld is immutable and shared: the world's
// settings, its instances, and whatever the engine compiled from them. An Engine is a state made from it:
// positions, velocities, drives, applied loads, time. Any number of engines on any number of threads share
// one compilation; each of them belongs to one thread at a time.
//
// Calls of an Engine never allocate or throw unless they say so; an index out of range is a
// std::out_of_range. After step() everything reported is of one instant.

#include <Eigen/Core>
#include <compare>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/core/time.h"
#include "doppel/export.h"
#include "doppel/physics/model_instance.h"
#include "doppel/physics/world.h"

namespace doppel {

// How far an engine may be from the closed forms and the independent dynamics that the contract tests compare
// it with (docs/engines.md prints them).
struct EngineTolerances {
  double period = 1e-4;       // of a pendulum's period, relative, at 1 ms
  double free_fall = 1e-6;    // m after 1 s at 1 ms, beside the integrator's own error
  double holding = 1e-3;      // of the effort that holds a joint against inverse dynamics, relative
  double sag = 1e-3;          // of torque / stiffness, relative
  double stiction = 1e-6;     // rad/s of a joint that friction holds
  double mimic = 1e-4;        // rad that a mimic strays under load
  double penetration = 1e-3;  // m that a box of 1 kg sinks into the ground
};

// What an engine can do. What it lacks is reported by name at the start, where a scenario needs it
// (lacking()).
struct EngineCapabilities {
  std::string name, version;  // "mujoco", "2.2.2"
  bool contacts = false, rays = false;
  bool floating = false, planar = false;  // joint types beside the scalar ones
  bool mimics = false, friction = false;  // of joints
  bool stops = false;                     // limit stops with a stiffness
  bool ideal = false;                     // ideal servos
  std::vector<Integrator> integrators;    // the first is the default
  EngineTolerances tolerances;
};

// A body: a link of an instance. The ground is instance -1, link 0.
struct DOPPEL_API BodyId {
  int instance = -1, link = 0;
  [[nodiscard]] bool is_ground() const { return instance < 0; }
  auto operator<=>(const BodyId&) const = default;
};

struct Contact {
  BodyId a, b;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();        // m
  Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();  // unit, from a to b
  Eigen::Vector3d force_W = Eigen::Vector3d::Zero();    // N, on b
  double depth = 0;                                     // m, positive: penetrating
};

// Of a frame's origin and of its rotation, in world axes.
struct FrameVelocity {
  Eigen::Vector3d linear_W = Eigen::Vector3d::Zero();   // m/s
  Eigen::Vector3d angular_W = Eigen::Vector3d::Zero();  // rad/s
};

struct RayHit {
  double distance = -1;  // m; negative: nothing hit
  BodyId body;
};

// A pair that never collides, and why. Of a robot and an object or the ground, the robot's link is `a`.
struct ExcludedPair {
  BodyId a, b;
  std::string reason;     // "joined by Revolute 2", "touching at the start", "inside at the start"
  double depth = 0;       // m: how far one lies in the other at the start
  bool at_start = false;  // found there, not told by the structure
};

// What drives a scalar joint. Mimic joints are moved by a physical coupling to their leader, never by a
// drive.
enum class DriveMode {
  passive,   // nothing: the joint moves freely
  position,  // a servo holds the target position (servo.h)
  velocity,  // a servo holds the target velocity
  effort,    // the target is the effort, clipped at the limit
};

struct DriveState {
  DriveMode mode = DriveMode::passive;
  // The last target that counted: a position, velocity or effort, by the mode; where nothing came since
  // set_drive(), the position that the drive holds, else 0.
  double target = 0;
  // Where the servo's own reference stands on its way to the target; under load the joint sags behind it.
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
  // The name of a body for people: "ground", an object's name, or a link's.
  [[nodiscard]] const std::string& name_of(BodyId body) const;

  // A state at reset: every instance at q0, at rest, time 0, drives passive. Throws std::bad_alloc only.
  [[nodiscard]] virtual std::unique_ptr<Engine> make_engine() const = 0;
  // The same settings with other instances. What never collides because it touched at the start stays so
  // where both instances are there under their names; of new instances it is found as at a start. Throws
  // InputError; on any thread.
  [[nodiscard]] virtual std::shared_ptr<const CompiledWorld> with(std::vector<ModelInstance> instances,
                                                                  Diagnostics& diagnostics) const = 0;

 protected:
  // Sets on the ground what is to stand there (ModelInstance::set_on_ground). Throws InputError: two
  // instances of one name, one named "ground".
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
  [[nodiscard]] std::span<const double> q() const;  // [nq]
  [[nodiscard]] std::span<const double> v() const;  // [nv]
  // Effort of each joint's drive in the last step [joints]; 0 where passive or not scalar. N m or N.
  [[nodiscard]] std::span<const double> drive_effort() const;
  // Writes the whole state (drives' references follow q, so that nothing jumps back). Mimics are set from
  // their leaders.
  void set_state(std::span<const double> q, std::span<const double> v);
  // Where links[0] stands: state, since a fixed object or base may be moved.
  [[nodiscard]] const Pose& root_pose() const;  // X_WR
  void set_root_pose(const Pose& X_WR);
  // The base link is put there, at rest: a floating one by its joint, a fixed one by its root.
  void place(const Pose& X_WB);
  // Of a floating base; no effect on a fixed one.
  void set_base_velocity(const FrameVelocity& velocity);
  // Lifts a floating joint from the root so far that no shape of the instance is below the ground. Allocates.
  void lift_out_of_ground();

  // Targets that are no finite numbers are ignored. Switching to position or velocity starts from where the
  // joint is. Precondition: joints[joint] is scalar, no mimic.
  void set_drive(int joint, DriveMode mode);
  [[nodiscard]] DriveState drive_state(int joint) const;  // of a mimic: passive
  [[nodiscard]] DriveMode drive(int joint) const { return drive_state(joint).mode; }
  void set_target(int joint, double target);
  [[nodiscard]] double drive_target(int joint) const { return drive_state(joint).target; }
  [[nodiscard]] double drive_reference(int joint) const { return drive_state(joint).reference; }
  void set_drive_reference(int joint, double reference);

  // External effort on a scalar joint and wrench on a link (at the point p_LoP_L, force and torque in world
  // axes), until cleared; a second one on the same joint or link replaces the first. Nothing moves a fixed
  // body.
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
  // Empty: no instance has this name.
  [[nodiscard]] std::optional<Instance> find(std::string_view name);
  [[nodiscard]] std::optional<const Instance> find(std::string_view name) const;

  // A further state of the same compilation, equal to this one to the bit; allocates.
  [[nodiscard]] virtual std::unique_ptr<Engine> clone() const = 0;
  // Equal to `from` to the bit. Precondition: the same compilation, else std::invalid_argument.
  virtual void copy_state(const Engine& from) = 0;

  // Back to q0, at rest, time 0, all drives passive, no applied loads, every root at its X_WR.
  virtual void reset() = 0;
  // One step of WorldSettings::step.
  virtual void step() = 0;
  [[nodiscard]] virtual Time time() const = 0;  // steps since reset, exact
  // Goes on counting from the last whole step before `now`: how an engine takes over from another one.
  virtual void set_time(Time now) = 0;
  // True from the step on in which the numbers ran away. That step and all further ones leave state and time
  // unchanged.
  [[nodiscard]] virtual bool diverged() const = 0;
  virtual void clear_applied() = 0;  // joint efforts and wrenches on all instances

  // Of everything that moves.
  [[nodiscard]] virtual double kinetic_energy() const = 0;    // J
  [[nodiscard]] virtual double potential_energy() const = 0;  // J, zero at z = 0

  // May allocate.
  virtual void contacts(std::vector<Contact>& out) const = 0;
  // direction_W need not be of unit length. A zero one hits nothing.
  [[nodiscard]] virtual RayHit cast_ray(const Eigen::Vector3d& from_W,
                                        const Eigen::Vector3d& direction_W) const = 0;

  // Compiles (it allocates) and continues with other instances: what keeps its name and its model keeps its
  // state, drives and loads. Throw InputError (a name taken); nothing has changed then.
  void set_instances(std::vector<ModelInstance> instances);
  // The same with a compilation that was made beforehand, on any thread, by world().with().
  void continue_with(std::shared_ptr<const CompiledWorld> world);
  void spawn(ModelInstance instance);
  bool remove(std::string_view name);  // false: no such instance

 protected:
  explicit Engine(std::shared_ptr<const CompiledWorld> world) : world_(std::move(world)) {}
  Engine(const Engine&) = default;
  Engine(Engine&&) = default;
  Engine& operator=(Engine&&) = default;

  // From now on a state of `world`: for each of its instances, the instance of this engine whose state it
  // keeps, or -1. Time continues. Nothing changes where it throws.
  virtual void become(std::shared_ptr<const CompiledWorld> world, std::span<const int> kept) = 0;
  std::shared_ptr<const CompiledWorld> world_;

 private:
  friend class Instance;
  // Of an instance by its index; all indices are in range.
  [[nodiscard]] virtual std::span<const double> q_of(int instance) const = 0;
  [[nodiscard]] virtual std::span<const double> v_of(int instance) const = 0;
  [[nodiscard]] virtual std::span<const double> drive_effort_of(int instance) const = 0;
  virtual void write_state(int instance, std::span<const double> q, std::span<const double> v) = 0;
  [[nodiscard]] virtual const Pose& root_pose_of(int instance) const = 0;
  virtual void write_root_pose(int instance, const Pose& X_WR) = 0;
  virtual void start_drive(int instance, int joint, DriveMode mode) = 0;
  [[nodiscard]] virtual DriveState drive_of(int instance, int joint) const = 0;
  virtual void write_target(int instance, int joint, double target) = 0;
  virtual void write_reference(int instance, int joint, double reference) = 0;
  virtual void write_joint_effort(int instance, int joint, double effort) = 0;
  virtual void write_wrench(int instance, int link, const Eigen::Vector3d& p_LoP_L,
                            const Eigen::Vector3d& force_W, const Eigen::Vector3d& torque_W) = 0;
  [[nodiscard]] virtual Pose pose_of(int instance, int link) const = 0;
  [[nodiscard]] virtual FrameVelocity velocity_of(int instance, int link) const = 0;
};

}  // namespace doppel
