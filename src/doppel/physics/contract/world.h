#pragma once
// The environment of the robots: gravity, ground, step, free or fixed objects, and the robots themselves. A
// world file is YAML (docs/worlds.md).

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/time.h"
#include "doppel/base/packages/package_resolver.h"
#include "doppel/description/meshes/lighting.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/physics/contract/world_robot.h"

namespace doppel {

struct WorldObject {
  std::string name;
  Geometry shape;                          // mesh: its convex hull collides
  Pose X_WO = Pose::Identity();            // initial pose, also after a reset
  Pose X_OS = Pose::Identity();            // the shape in the object's frame
  double mass = 0;                         // kg; 0: fixed to the world
  double friction = 0.8;                   // Coulomb
  std::optional<double> restitution = {};  // speed after an impact over that before, 0..1
  Eigen::Vector4d rgba{0.55, 0.6, 0.65, 1.0};
  SourceLocation source;  // in the world file; unknown: spawned while the world runs
};

// The integration of a step (physics/contract/step_scheme.h, docs/physics.md). Springs and dampers of joints are
// implicit in all of them.
enum class Integrator {
  euler,     // semi-implicit, order 1, one evaluation of the forward dynamics: the default
  midpoint,  // order 2, two; euler in a step that begins with a robot in contact or against a stiff stop
  rk4,       // order 4, four; euler in a step that begins against a stop with a stiffness
  implicit,  // euler with the derivatives of Coriolis forces, at about twice its cost
};
inline constexpr const char* kIntegratorNames[] = {"euler", "midpoint", "rk4", "implicit"};
inline const char* name_of(Integrator integrator) {
  return kIntegratorNames[static_cast<int>(integrator)];
}
// Throws InputError (`rule` at `where`, with the nearest name) if there is no such integrator.
DOPPEL_API Integrator integrator_named(const std::string& name, const std::string& rule,
                                       const SourceLocation& where = {});

// The friction of two shapes that touch, where none of them decides it (friction.h).
enum class FrictionRule {
  larger,   // of the two coefficients, as in MuJoCo: that of a YAML file without another word
  smaller,  // of the two coefficients, as in Gazebo: that of SDF worlds
};

inline constexpr double kMinStep = 1e-6, kMaxStep = 0.02;  // s

struct WorldSettings {
  std::string name = "empty";
  Eigen::Vector3d gravity{0, 0, -9.81};  // m/s^2, world axes
  Duration step{1'000'000};              // 1 ms
  bool step_is_given = false;            // by the file; else it may follow the rates of controllers
  Integrator integrator = Integrator::euler;
  bool ground = true;                             // an infinite plane at z = 0
  double ground_friction = 0.8;                   // Coulomb
  std::optional<double> ground_restitution = {};  // 0..1; nullopt: that of what touches it
  FrictionRule friction_rule = FrictionRule::larger;
  // The appearance; it has no effect on the physics.
  std::vector<Light> lights;               // empty: those of whoever draws
  std::optional<Environment> environment;  // nullopt: not written
};

struct DOPPEL_API World : WorldSettings {
  Pose X_WR = Pose::Identity();  // root link of a robot without a pose of its own
  std::vector<WorldObject> objects;
  std::vector<WorldRobot> robots;
};

// Reads and checks a world file. Throws InputError, with line and column, for unknown keys, wrong types
// and impossible values.
DOPPEL_API World load_world(const std::filesystem::path& file, PackageResolver& resolver);

}  // namespace doppel
