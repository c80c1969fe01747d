#pragma once
// Robots that are spawned while the twin runs: prepared on a thread of their own, which may never end, and
// added to the twin between two steps.

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <variant>

#include "doppel/base/core/abandoned_thread.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/physics/contract/world_robot.h"
#include "doppel/scenario/sdf/sdf_world.h"
#include "doppel/twin/loop/twin_core.h"

namespace doppel {

using SpawnedText = std::variant<std::string, SdfModel>;  // a URDF, or a read model of SDF

// Prepares a robot on any thread while the twin runs: description, model, shapes, the world compiled with it,
// and its controllers rehearsed. `text`: a URDF, or a model of SDF that its plugins drive. Throws InputError.
[[nodiscard]] DOPPEL_API std::shared_ptr<JoiningRobot> prepare_robot(const RunningMachine& running,
                                                                     const WorldRobot& robot,
                                                                     const SpawnedText& text,
                                                                     Diagnostics& diagnostics);

// The loop's thread, between steps.
class DOPPEL_API RobotSpawner {
 public:
  explicit RobotSpawner(TwinCore& core);
  // `deadline`: the time after which another robot may be spawned instead of one that is still being built.
  RobotSpawner(TwinCore& core, std::chrono::milliseconds deadline);
  ~RobotSpawner();
  RobotSpawner(const RobotSpawner&) = delete;
  RobotSpawner& operator=(const RobotSpawner&) = delete;

  // Brings up a robot under its namespace at its pose. `done` is called later, on the loop's thread, or at
  // once with a refusal: another robot is being spawned, or too many builds have not ended.
  using Done = std::function<void(const Status&)>;
  void spawn(WorldRobot robot, SpawnedText text, Done done);

 private:
  struct Spawning;
  struct BuildResults;
  void build(const std::shared_ptr<Spawning>& job);
  void settle(const std::shared_ptr<Spawning>& job);
  void answer(const Spawning& job, const Status& status);
  void abandon_build();

  TwinCore& core_;
  const std::chrono::milliseconds deadline_;
  int jobs_ = 0;                        // so far
  std::shared_ptr<Spawning> spawning_;  // by `builds_`; nullptr: none
  const std::shared_ptr<BuildResults> build_results_;
  AbandonableWork builds_;
};

}  // namespace doppel
