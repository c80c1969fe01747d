#pragma once
// The contract of a physics engine: built from a description and a world, then reset, stepped, read and
// written. Calls never allocate or throw unless they say so. After step() everything reported is of one
// instant. One thread at a time.

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/kinematics/model.h"
#include "doppel/physics/servo.h"
#include "doppel/physics/world.h"

namespace doppel {

struct EngineCapabilities {
  std::string name;  // "mujoco 2.2.2"
  bool rays = false, spawn = false, contacts = false;
};

// What drives a scalar joint. Mimic joints are moved by a physical coupling to their leader, never by a
// drive.
enum class DriveMode {
  limp,      // nothing: the joint moves freely
  position,  // a servo holds the target position (servo.h)
  velocity,  // a servo holds the target velocity
  effort,    // the target is the effort, clipped at the limit
};

struct Contact {
  int link_a = -1, link_b = -1;                         // model links; -1: the world or one of its objects
  std::string_view object_a, object_b;                  // the object's name where the link is -1 ("ground")
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
  int link = -1;         // -1: world or object
};

// A pair that never collides, and why: two links, or a link and the ground or an object.
struct ExcludedPair {
  std::string link_a, link_b;
  std::string reason;  // "joined by Revolute 2", "touching at the start", "inside at the start"
  double depth = 0;    // m: how far the link lies in the ground or the object at the start
};

struct EngineOptions {
  Eigen::VectorXd q0;                   // [nq] the pose at reset; empty: Model::neutral()
  std::vector<ServoParameters> servos;  // [joints]; empty: choose_servos()
  bool self_collision = true;
  // A floating joint from the root moves along z so that the lowest point of the robot's shapes lies on the
  // ground; where the world places the robot, it is only lifted out of the ground.
  bool set_on_ground = false;
};

class Engine {
 public:
  virtual ~Engine() = default;

  [[nodiscard]] virtual EngineCapabilities capabilities() const = 0;
  [[nodiscard]] virtual const std::vector<ExcludedPair>& excluded_pairs() const = 0;
  [[nodiscard]] virtual std::span<const ServoParameters> servos() const = 0;  // [joints]

  // Back to q0, at rest, time 0, all drives limp, no applied forces, objects where they were put.
  virtual void reset() = 0;
  // One step of World::step.
  virtual void step() = 0;
  [[nodiscard]] virtual Time time() const = 0;  // steps since reset, exact
  // Goes on counting from the last whole step before `now`: how an engine takes over from another one.
  virtual void set_time(Time now) = 0;
  // True from the step on in which the numbers ran away. That step and all further ones leave state and time
  // unchanged.
  [[nodiscard]] virtual bool diverged() const = 0;

  // State of the model's joints; q and v are indexed as in Model. Valid until spawn() or remove().
  [[nodiscard]] virtual std::span<const double> q() const = 0;  // [nq]
  [[nodiscard]] virtual std::span<const double> v() const = 0;  // [nv]
  // Effort of each joint's drive in the last step [joints]; 0 where limp or not scalar. N m or N.
  [[nodiscard]] virtual std::span<const double> drive_effort() const = 0;
  // Writes the whole state (drives' references follow q, so that nothing jumps back). Mimics are set from
  // their leaders.
  virtual void set_state(std::span<const double> q, std::span<const double> v) = 0;

  // Lifts a floating joint from the root so far that no shape of the robot is below the ground.
  virtual void lift_out_of_ground() = 0;

  // Targets that are no finite numbers are ignored. Switching to position or velocity starts from where the
  // joint is. Precondition: joints[joint] is scalar, no mimic.
  virtual void set_drive(int joint, DriveMode mode) = 0;
  [[nodiscard]] virtual DriveMode drive(int joint) const = 0;
  virtual void set_target(int joint, double target) = 0;
  // The last target that counted: a position, velocity or effort, by the drive's mode; where nothing came
  // since set_drive(), the position that the drive holds, else 0.
  [[nodiscard]] virtual double drive_target(int joint) const = 0;
  // Where the servo's own reference stands on its way to the target; under load the joint sags behind it.
  [[nodiscard]] virtual double drive_reference(int joint) const = 0;
  virtual void set_drive_reference(int joint, double reference) = 0;

  // External effort on a scalar joint and wrench on a link (at the point p_LoP_L, force and torque in world
  // axes), until cleared; a second one on the same joint or link replaces the first.
  virtual void apply_joint_effort(int joint, double effort) = 0;
  virtual void apply_wrench(int link, const Eigen::Vector3d& p_LoP_L, const Eigen::Vector3d& force_W,
                            const Eigen::Vector3d& torque_W) = 0;
  // The same on a loose object, at p_OoP_O; nothing moves a fixed one. False: no such object.
  virtual bool apply_object_wrench(std::string_view name, const Eigen::Vector3d& p_OoP_O,
                                   const Eigen::Vector3d& force_W, const Eigen::Vector3d& torque_W) = 0;
  virtual void clear_applied() = 0;

  [[nodiscard]] virtual Pose link_pose(int link) const = 0;  // X_WL
  [[nodiscard]] virtual FrameVelocity link_velocity(int link) const = 0;
  [[nodiscard]] virtual double kinetic_energy() const = 0;    // J, robot and loose objects
  [[nodiscard]] virtual double potential_energy() const = 0;  // J, zero at z = 0

  // May allocate.
  virtual void contacts(std::vector<Contact>& out) const = 0;
  [[nodiscard]] virtual RayHit cast_ray(const Eigen::Vector3d& from_W,
                                        const Eigen::Vector3d& direction_W) const = 0;
  // Objects of the world, by name; false: no such object. Setting a pose leaves the object at rest; a
  // velocity is kept by loose objects only.
  [[nodiscard]] virtual const std::vector<WorldObject>& objects() const = 0;  // as they were put
  virtual bool object_pose(std::string_view name, Pose& X_WO) const = 0;
  virtual bool object_velocity(std::string_view name, FrameVelocity& velocity) const = 0;
  virtual bool set_object_pose(std::string_view name, const Pose& X_WO) = 0;
  virtual bool set_object_velocity(std::string_view name, const FrameVelocity& velocity) = 0;
  // Adding and removing recompiles (it allocates) and keeps the state. Throw InputError (name taken, mesh
  // unreadable); nothing has changed then.
  virtual void spawn(const WorldObject& object) = 0;
  virtual bool remove(std::string_view name) = 0;
  // In place of those that are there; what keeps its name keeps its state.
  virtual void set_objects(std::vector<WorldObject> objects) = 0;
};

// Throws InputError where the engine refuses the model, in the user's terms (link or joint and its place).
std::unique_ptr<Engine> make_mujoco_engine(const RobotDescription& robot, const Model& model,
                                           const World& world, const EngineOptions& options,
                                           Diagnostics& diagnostics);

}  // namespace doppel
