#pragma once
// A scenario's files, compiled before anything is on the bus: the world, its robots, and their engine. Built
// on any thread, so that an edit is checked while the old machine keeps running.

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/physics/contract/keep_out.h"
#include "doppel/scenario/compile/compiled_robot.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel {

// The running robots, for a machine that is to replace theirs.
struct RunningRobots {
  std::vector<std::shared_ptr<const CompiledRobot>> now;
  std::vector<WorldRobot> in_file;  // those of the world file when it was read
};

// The sensors of a model of an SDF world that is no robot: a camera on a wall.
struct ModelSensors {
  std::string model;  // in the engine
  bool is_static = false;
  RobotSensors sensors;
};

struct DOPPEL_API CompiledScenario {
  // Throws InputError. `running`: robots that were deleted by a service stay deleted, spawned ones stay, and
  // bases keep their type.
  CompiledScenario(const Scenario& scenario, Diagnostics& diagnostics,
                   const RunningRobots* running = nullptr);
  CompiledScenario(const CompiledScenario&) = delete;
  CompiledScenario& operator=(const CompiledScenario&) = delete;

  // nullptr: no robot has this namespace.
  [[nodiscard]] std::shared_ptr<const CompiledRobot> find(std::string_view name_space) const;
  // All files that it was made from: descriptions, controllers, world and meshes.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;

  const std::uint64_t number;  // another one for each compilation in this process
  PackageResolver resolver;
  World world;
  EarthFrame earth;
  std::vector<std::string> in_file;                          // the names of the objects of the world file
  std::vector<KeepOutBox> keep_out;                          // of a world file in YAML
  std::vector<std::filesystem::path> included;               // the files that an SDF world is made of
  std::vector<std::shared_ptr<const CompiledRobot>> robots;  // none: a world of objects
  std::shared_ptr<const std::vector<ModelSensors>> model_sensors;
  std::unique_ptr<Engine> engine;

 private:
  std::vector<SdfModel> read_world(const Scenario& scenario, Diagnostics& diagnostics);
  // Without a step of the world's own, the one that the controllers' rates need.
  void choose_step(Diagnostics& diagnostics);
  void find_driven(const std::vector<SdfModel>& models, const Scenario& scenario, Diagnostics& diagnostics);
};

// The handle of the robot's instance. Throws std::logic_error if it is not in the engine.
[[nodiscard]] DOPPEL_API Instance instance_of(Engine& engine, const CompiledRobot& robot);

// Throws InputError if a namespace is invalid or used by two robots. Of several robots without a namespace
// the later ones get a generated one, with a note.
DOPPEL_API void name_robots(std::vector<WorldRobot>& robots, Diagnostics& diagnostics);

// The namespace of a model that is a robot: the wanted one, or, if another robot has it, one with the
// model's name.
[[nodiscard]] DOPPEL_API std::string free_model_namespace(const std::string& wanted, const std::string& model,
                                                          const std::vector<std::string>& taken);

// One warning for the ground, each object and each later robot in the world inside which links of
// the robot start.
DOPPEL_API void report_overlaps(const CompiledRobot& robot, const Engine& engine, Diagnostics& diagnostics);

// Throws InputError if a joint that is within its limits in `from` would be outside of them in `to`,
// would lose its whole range, or if its <mimic> or axis would lose its effect, because a typo must not
// move a running machine.
DOPPEL_API void refuse_lost_range(const CompiledScenario& from, const CompiledScenario& to);

// Carries over the time, the state and drives' references of every joint of the same robot with the same name
// and type, and the poses and velocities of objects. Objects that were spawned stay, and those that were
// deleted stay deleted. Throws InputError if a spawned object cannot be used any more.
DOPPEL_API void carry_over_state(const CompiledScenario& from, CompiledScenario& to);

}  // namespace doppel
