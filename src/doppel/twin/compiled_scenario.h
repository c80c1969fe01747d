#pragma once
// What a scenario's files make before anything is on the bus: the world, its robots, and the engine that they
// stand in. Built on any thread, so that an edit is judged while the old machine keeps running.

#include <memory>
#include <string_view>
#include <vector>

#include "doppel/export.h"
#include "doppel/physics/engine.h"
#include "doppel/twin/compiled_robot.h"

namespace doppel {

// The robots that run, for a machine that is to replace theirs.
struct RunningRobots {
  std::vector<std::shared_ptr<const CompiledRobot>> now;
  std::vector<WorldRobot> in_file;  // that the world file named when it was read
};

struct DOPPEL_API CompiledScenario {
  // Throws InputError. `running`: robots that were deleted by hand stay away, those that were put in stay,
  // and bases stand as they did.
  CompiledScenario(const Scenario& scenario, Diagnostics& diagnostics,
                   const RunningRobots* running = nullptr);
  CompiledScenario(const CompiledScenario&) = delete;
  CompiledScenario& operator=(const CompiledScenario&) = delete;

  // Null: none has this namespace.
  [[nodiscard]] std::shared_ptr<const CompiledRobot> find(std::string_view name_space) const;
  // Every file that it was made of: the descriptions', the controllers', the world's, the meshes.
  [[nodiscard]] std::vector<std::filesystem::path> files(const Scenario& scenario) const;

  PackageResolver resolver;
  World world;
  std::vector<std::shared_ptr<const CompiledRobot>> robots;  // at least one
  std::unique_ptr<Engine> engine;
};

// The handle of the robot's instance. Throws std::logic_error where it is not in the engine.
[[nodiscard]] DOPPEL_API Instance instance_of(Engine& engine, const CompiledRobot& robot);

// Throws InputError where a namespace is none or stands for two robots. More than one robot without a
// namespace: the later ones get one of their own, with a note.
DOPPEL_API void name_robots(std::vector<WorldRobot>& robots, Diagnostics& diagnostics);

// Links of the robot that start inside the ground, an object or a robot behind it in the world: one warning
// for each of these.
DOPPEL_API void report_overlaps(const CompiledRobot& robot, const Engine& engine, Diagnostics& diagnostics);

// Throws InputError where a joint that stands within its limits in `from` would stand outside of them in
// `to`, would lose its whole range, or where what is written of its <mimic> or axis would have no effect any
// more: a typo must not drive a machine that runs.
DOPPEL_API void refuse_lost_range(const CompiledScenario& from, const CompiledScenario& to);

// Time, the state and drives' references of every joint of the same robot with the same name and type, the
// poses and velocities of objects, those that were put in while the machine ran, and without those that were
// deleted. Throws InputError where an object that was put in cannot be used any more.
DOPPEL_API void carry_over_state(const CompiledScenario& from, CompiledScenario& to);

}  // namespace doppel
