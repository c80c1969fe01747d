#pragma once
// The content of a world: instances of models, each with a unique name. A robot is an instance; an object is
// an instance that nothing drives. An instance holds everything that an engine is built from, so that no engine
// reads a file: the compiled model, the collision shapes of its links, its servos and its initial pose.

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/physics/contract/servo.h"
#include "doppel/physics/contract/wheels.h"
#include "doppel/physics/contract/world.h"
#include "doppel/robot/collision/link_shapes.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

struct DOPPEL_API ModelInstance {
  std::string name;                                     // unique in its world; never "ground"
  std::shared_ptr<const RobotDescription> description;  // visuals and source locations; not read by engines
  std::shared_ptr<const Model> model;
  LinkShapes shapes;                    // [links]
  Pose X_WR = Pose::Identity();         // links[0] of the model, which does not move
  Eigen::VectorXd q0;                   // [nq] rad, m: the configuration at reset
  std::vector<ServoParameters> servos;  // [joints]
  std::vector<RollingPart> rolling;     // wheels and casters, whose shapes are as they roll
  bool self_collision = true;
  // A floating joint from the root moves along z so that the lowest point of the shapes lies on the ground;
  // where X_WR is not the identity, it is only lifted out of the ground.
  bool set_on_ground = false;
  bool passive = false;          // a model of the world: nothing drives its joints
  Pose X_BO = Pose::Identity();  // the frame by which an object is placed, in its base link

  // Passive, or one body: its model has one link, besides the "world" above a floating one.
  [[nodiscard]] bool is_object() const;
  // The root link, or the child of the floating joint.
  [[nodiscard]] int base_link() const;
  [[nodiscard]] bool floating() const;  // its base moves freely
};

struct InstanceOptions {
  std::string name;                      // empty: the description's
  Pose X_WR = Pose::Identity();          // links[0] of the model in the world
  Eigen::VectorXd q0;                    // empty: Model::neutral()
  std::vector<ServoParameters> servos;   // empty: choose_servos() under `gravity`
  Eigen::Vector3d gravity{0, 0, -9.81};  // m/s^2, world axes
  bool self_collision = true, set_on_ground = false, passive = false;
  Pose X_BO = Pose::Identity();
};

// A mesh that cannot be read, or a shape without a size, is left out with a warning at its place.
DOPPEL_API ModelInstance make_instance(std::shared_ptr<const RobotDescription> description,
                                       std::shared_ptr<const Model> model, const InstanceOptions& options,
                                       CollisionMeshes& meshes, Diagnostics& diagnostics);

// An object: it moves freely if it has a mass, else it is fixed to the world. Throws InputError: a mesh that
// cannot be read, no size, a mass below 1e-9 kg that is not 0, numbers that are not finite.
DOPPEL_API ModelInstance make_instance(const WorldObject& object, CollisionMeshes& meshes,
                                       Diagnostics& diagnostics);

// Index of the instance with this name; -1: none.
[[nodiscard]] DOPPEL_API int find_instance(std::span<const ModelInstance> instances, std::string_view name);

}  // namespace doppel
